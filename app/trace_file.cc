#include "app/trace_file.h"

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <string>

#include "app/cli.h"
#include "app/scene_input.h"
#include "recorder/world.h"
#include "web/wire.h"

namespace flowscope::app {
namespace {

using web::wire::Json;

constexpr std::size_t most_bytes = 128u << 20, most_values = 4'000'000;
constexpr int deepest = 16;

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& place,
                       const std::string& problem) {
  throw UsageError(file.string() + ": " + (place.empty() ? "" : place + ": ") + problem);
}

std::string read_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string text, part(1 << 16, '\0');
  while (in && text.size() <= most_bytes) {
    in.read(part.data(), static_cast<std::streamsize>(part.size()));
    text.append(part, 0, static_cast<std::size_t>(in.gcount()));
  }
  if (!in.eof() && text.size() <= most_bytes)
    throw UsageError("--trace " + file.string() + ": cannot be read");
  if (text.size() > most_bytes) fail(file, "", "is larger than 128 MiB, so it is no trace file");
  return text;
}

/// Bounds while reading: what is refused is never held in memory.
class Bounds {
 public:
  bool operator()(int depth, Json::parse_event_t event, const Json& value) {
    using Event = Json::parse_event_t;
    if (depth > deepest) throw std::length_error("nested deeper than 16 levels");
    if (++values_ > most_values) throw std::length_error("holds more than 4 million values");
    if (event == Event::object_start) keys_.emplace_back();
    if (event == Event::object_end) keys_.pop_back();
    if (event == Event::key && !keys_.back().insert(value.get<std::string>()).second)
      throw std::length_error("key " + value.get<std::string>().substr(0, 64) + " appears twice");
    return true;
  }

 private:
  std::vector<std::set<std::string>> keys_;
  std::size_t values_ = 0;
};

Json parse(const std::filesystem::path& file) {
  const std::string text = read_text(file);
  Bounds bounds;
  try {
    return Json::parse(
        text, [&](int depth, Json::parse_event_t event, Json& value) { return bounds(depth, event, value); });
  } catch (const std::length_error& error) {
    fail(file, "", error.what());
  } catch (const Json::exception& error) {
    const std::string what = error.what();  // "[json.exception.…] parse error at line 1, column 2: …"
    fail(file, "",
         "not JSON: " + what.substr(what.find("] ") == std::string::npos ? 0 : what.find("] ") + 2));
  }
}

FlowTrace trace_at(const Json& json, const std::string& place, const std::filesystem::path& file) {
  try {
    return web::wire::trace_from_json(json, place);
  } catch (const web::ApiError& error) {
    std::string what = error.what();
    if (what.starts_with(error.where + " ")) what.erase(0, error.where.size() + 1);
    fail(file, error.where == "body" ? "" : error.where, what);
  }
}

bool same_scene(const TraceScene& a, const TraceScene& b) {
  return a.task == b.task && a.variation == b.variation && a.seed == b.seed && a.demo == b.demo &&
         a.keyframe == b.keyframe && a.state_sha256 == b.state_sha256;
}

SceneState scene_in_demo(const DemoStore& store, const TraceScene& scene, const std::filesystem::path& file) {
  Demo demo;
  try {
    demo = store.load(*scene.demo);
  } catch (const std::out_of_range& error) {
    fail(file, "scene.demo", error.what());
  }
  if (demo.info.task != scene.task)
    fail(file, "scene.task", "is " + scene.task + ", but the demonstration is of " + demo.info.task);
  const int k = scene.keyframe.value_or(0), last = static_cast<int>(demo.keyframes.size());
  if (k > last) fail(file, "scene.keyframe", "the demonstration has keyframes 0 to " + std::to_string(last));
  const int frame = k == 0 ? 0 : demo.keyframes[static_cast<std::size_t>(k - 1)].frame;
  const SceneState& state = demo.frames.at(static_cast<std::size_t>(frame)).state;
  if (!scene.state_sha256.empty() && state_sha256(state) != scene.state_sha256)
    fail(file, "scene.state_sha256",
         "is not that of " + *scene.demo + " at keyframe " + std::to_string(k) +
             ": give the data folder of the prediction with --data");
  return state;
}

}  // namespace

std::vector<FlowTrace> read_trace_file(const std::filesystem::path& file) {
  const Json json = parse(file);
  if (!json.is_array()) return {trace_at(json, "", file)};
  std::vector<FlowTrace> traces;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const std::string place = "[" + std::to_string(i) + "]";
    traces.push_back(trace_at(json[i], place, file));
    if (!same_scene(traces.front().scene, traces.back().scene))
      fail(file, place + ".scene", "is another one than [0].scene: samples share their scene");
  }
  if (traces.empty()) fail(file, "", "holds no trace");
  return traces;
}

SceneState scene_of_trace(const TaskLibrary& tasks, const DemoStore& store, const FlowTrace& trace,
                          const std::filesystem::path& file) {
  const TraceScene& scene = trace.scene;
  if (scene.demo) return scene_in_demo(store, scene, file);
  if (scene.keyframe.value_or(0) > 0) {
    fail(file, "scene.keyframe",
         "this prediction was made in the middle of a live episode; export it from the page");
  }
  std::shared_ptr<const Task> task;
  try {
    task = tasks.get(scene.task);
  } catch (const std::invalid_argument& error) {
    fail(file, "scene.task", error.what());
  }
  if (scene.variation >= task->variations())
    fail(file, "scene.variation",
         scene.task + " has variations 0 to " + std::to_string(task->variations() - 1));
  World world(task);
  world.reset(scene.variation, scene.seed);
  if (!scene.state_sha256.empty() && state_sha256(world.state()) != scene.state_sha256)
    std::fprintf(stderr,
                 "flowscope: %s: scene.state_sha256: the scene drawn is not exactly that of the prediction\n",
                 file.c_str());
  return world.state();
}

}  // namespace flowscope::app
