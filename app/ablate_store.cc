#include "app/ablate_store.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "recorder/atomic_file.h"

namespace flowscope {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* format = "flowscope-ablation/1";
constexpr const char* results_name = "results.json";

Json to_json(const AblationBudget& b) {
  return {{"preset", b.preset},        {"tasks", b.tasks}, {"demonstrations", b.demonstrations},
          {"minutes", b.minutes},      {"steps", b.steps}, {"episodes", b.episodes},
          {"first_seed", b.first_seed}};
}

Json to_json(const AblationMeasure& m) {
  Json tasks = Json::array();
  for (const TaskScore& t : m.tasks)
    tasks.push_back({{"task", t.task},
                     {"successes", t.successes},
                     {"episodes", t.episodes},
                     {"first_attempts", t.first_attempts},
                     {"position_mm", t.position_mm}});
  return {{"flow_steps", m.flow_steps},
          {"tasks", tasks},
          {"ms_per_prediction", m.ms},
          {"seconds", m.seconds},
          {"failure", m.failure}};
}

AblationMeasure measure_of(const Json& json) {
  AblationMeasure m{
      json.at("flow_steps"), {}, json.at("ms_per_prediction"), json.at("seconds"), json.at("failure")};
  if (m.flow_steps < 1) throw std::invalid_argument("flow_steps must be positive");
  for (const Json& t : json.at("tasks")) {
    m.tasks.push_back(
        {t.at("task"), t.at("successes"), t.at("episodes"), t.at("first_attempts"), t.at("position_mm")});
    const TaskScore& score = m.tasks.back();
    if (score.successes < 0 || score.first_attempts < 0 || score.successes > score.episodes ||
        score.first_attempts > score.successes)
      throw std::invalid_argument(score.task + " has more successes than episodes, or fewer than none");
  }
  return m;
}

Json to_json(const AblationRun& r) {
  Json variant, measures = Json::array();
  visit_variant(r.variant, [&variant](const char* name, const auto& value) { variant[name] = value; });
  for (const AblationMeasure& m : r.measures) measures.push_back(to_json(m));
  return {{"key", key_of(r.variant)}, {"variant", variant},   {"seed", r.seed},
          {"policy", r.policy},       {"steps", r.steps},     {"minutes", r.minutes},
          {"loss", r.loss},           {"failure", r.failure}, {"measures", measures}};
}

/// Each entry of a list as `read` makes it; a complaint names its place.
template <typename Read>
auto read_list(const Json& list, const std::string& place, Read&& read) {
  std::vector<decltype(read(list))> entries;
  if (!list.is_array()) throw std::invalid_argument(place + ": must be a list");
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string entry = place + "[" + std::to_string(i) + "]";
    try {
      entries.push_back(read(list[i]));
    } catch (const nlohmann::json::exception& error) {
      throw std::invalid_argument(entry + ": " + error.what());
    } catch (const std::invalid_argument& error) {
      const std::string what = error.what();
      throw std::invalid_argument(entry + (what.starts_with("measures[") ? "." : ": ") + what);
    }
  }
  return entries;
}

AblationRun run_of(const Json& json) {
  AblationRun r;
  const Json& variant = json.at("variant");
  r.variant.part_middles = false;  // files older than this part do not name it
  visit_variant(r.variant, [&variant](const char* name, auto& value) {
    if (std::string_view(name) != "part_middles" || variant.contains(name)) variant.at(name).get_to(value);
  });
  r.seed = json.at("seed");
  r.policy = json.at("policy");
  r.steps = json.at("steps");
  r.minutes = json.at("minutes");
  r.loss = json.at("loss").is_null() ? 0 : json.at("loss").get<double>();
  r.failure = json.at("failure");
  if (std::filesystem::path(r.policy).filename() != r.policy)
    throw std::invalid_argument("policy '" + r.policy + "' is not a file name");
  r.measures = read_list(json.at("measures"), "measures", measure_of);
  return r;
}

/// Empty when they agree.
std::string differences(const Json& there, const Json& wanted) {
  std::string list;
  for (const auto& [name, value] : wanted.items())
    if (there.value(name, Json()) != value)
      list += (list.empty() ? "" : ", ") + name + " " + there.value(name, Json()).dump() + " and not " +
              value.dump();
  return list;
}

}  // namespace

const AblationMeasure* AblationRun::at(int flow_steps) const {
  const auto found = std::ranges::find(measures, flow_steps, &AblationMeasure::flow_steps);
  return found == measures.end() ? nullptr : &*found;
}

AblationStore::AblationStore(std::filesystem::path folder, AblationBudget budget)
    : folder_(std::move(folder)), budget_(std::move(budget)) {
  std::filesystem::create_directories(folder_);
  const std::filesystem::path results = file(results_name);
  if (!std::filesystem::exists(results)) return;
  try {
    std::ifstream stream(results);
    const Json json = Json::parse(stream);
    if (json.at("format") != format) throw std::invalid_argument(std::string("its format is not ") + format);
    const std::string other = differences(json.at("budget"), to_json(budget_));
    if (!other.empty()) throw std::invalid_argument("the results there were made with " + other);
    runs_ = read_list(json.at("runs"), "runs", run_of);
  } catch (const nlohmann::json::exception& error) {
    throw std::invalid_argument(results.string() + ": " + error.what());
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(results.string() + ": " + error.what());
  }
}

const AblationRun* AblationStore::find(const AblationVariant& variant, int seed) const {
  for (const AblationRun& run : runs_)
    if (run.variant == variant && run.seed == seed) return &run;
  return nullptr;
}

void AblationStore::put(const AblationRun& run) {
  const auto same = std::ranges::find_if(
      runs_, [&run](const AblationRun& r) { return r.variant == run.variant && r.seed == run.seed; });
  if (same == runs_.end())
    runs_.push_back(run);
  else
    *same = run;
  const std::string text = document().dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
  write_file_atomically(file(results_name),
                        {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

Json AblationStore::document() const {
  Json runs = Json::array();
  for (const AblationRun& run : runs_) runs.push_back(to_json(run));
  return {{"format", format}, {"budget", to_json(budget_)}, {"runs", runs}};
}

}  // namespace flowscope
