#include "app/ablate_table.h"

#include <algorithm>
#include <cstdio>
#include <stdexcept>

#include "app/evaluate.h"

namespace flowscope {
namespace {

using Runs = std::vector<AblationRun>;
using Row = std::vector<std::string>;

std::string number(const char* form, double value) {
  char text[32];
  std::snprintf(text, sizeof text, form, value);
  return text;
}

std::string success(const Runs& runs, const AblationCell& cell) {
  const auto s = summarise(runs, cell);
  if (!s) return "-";
  std::string seeds;
  for (const double fraction : s->by_seed)
    seeds += (seeds.empty() ? "" : ", ") + number("%.1f", 100 * fraction);
  return number("%.1f", 100.0 * s->successes / s->episodes) + " [" + number("%.1f", 100 * s->low) + "–" +
         number("%.1f", 100 * s->high) + "] (" + seeds + ")";
}

std::string milliseconds(const Runs& runs, const AblationCell& cell) {
  const auto s = summarise(runs, cell);
  return s ? number("%.1f", s->ms) : "-";
}

std::string seconds(const Runs& runs, const AblationCell& cell) {
  const auto s = summarise(runs, cell);
  return s ? number("%.3f", s->ms / 1000) : "-";
}

std::string markdown(const std::string& title, const Row& head, const std::vector<Row>& rows) {
  std::string text = "### " + title + "\n\n|";
  for (const auto& cell : head) text += " " + cell + " |";
  text += "\n|";
  for (std::size_t i = 0; i < head.size(); ++i) text += "---|";
  for (const Row& row : rows) {
    text += "\n|";
    for (const auto& cell : row) text += " " + cell + " |";
  }
  return text + "\n";
}

const char* mark(bool on) { return on ? "✓" : "✗"; }

std::string upper(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::toupper(c); });
  return text;
}

const std::vector<int> published_steps{2, 4, 8, 16, 32};
constexpr int table3_steps = 50, ddpm_steps = 100, our_steps = 4;

AblationVariant base_of(const TableChoice& choice) {
  AblationVariant base;
  base.grounded = !choice.paper_form;
  return base;
}

std::vector<int> steps_of(const TableChoice& choice) {
  return choice.flow_steps.empty() ? published_steps : choice.flow_steps;
}

AblationTable table3(const TableChoice& choice) {
  const int steps = choice.flow_steps.empty() ? table3_steps : choice.flow_steps.back();
  struct Parts {
    bool radius, point_encoder;
    const char* objective;
  };
  AblationTable table{"3", {}, {}};
  for (const char* backbone : {"mamba", "transformer"}) {
    for (const Parts& parts :
         {Parts{false, false, "cfm"}, Parts{false, true, "cfm"}, Parts{true, false, "cfm"},
          Parts{true, true, "cfm"}, Parts{true, true, "ddim"}}) {
      AblationVariant v = base_of(choice);
      v.backbone = backbone;
      v.radius = parts.radius ? v.radius : "off";
      v.point_encoder = parts.point_encoder;
      v.objective = parts.objective;
      table.cells.push_back({v, steps});
    }
  }
  table.markdown = [cells = table.cells, steps](const Runs& runs) {
    std::vector<Row> rows;
    for (const AblationCell& cell : cells) {
      const AblationVariant& v = cell.variant;
      rows.push_back({v.backbone == "mamba" ? "Mamba" : "Transformer", mark(v.radius != "off"),
                      mark(v.point_encoder), upper(v.objective), success(runs, cell), seconds(runs, cell)});
    }
    return markdown("Table 3: architectures and modules, " + std::to_string(steps) + " steps",
                    {"Architecture", "DRS", "P.E.", "T.O.", "Avg. success %", "Inference time s"}, rows);
  };
  return table;
}

struct NamedVariant {
  std::string name;
  AblationVariant variant;
};

/// Rows are variants, once by success and once by time, columns are steps: Tables 4 and C.
AblationTable steps_table(const std::string& name, const std::string& title,
                          const std::vector<NamedVariant>& variants, const std::vector<int>& steps) {
  AblationTable table{name, {}, {}};
  for (const NamedVariant& v : variants)
    for (const int count : steps) table.cells.push_back({v.variant, count});
  table.markdown = [=](const Runs& runs) {
    Row head{"", "i-steps"};
    for (const int count : steps) head.push_back(std::to_string(count));
    std::vector<Row> rows;
    for (const bool by_success : {true, false}) {
      for (const NamedVariant& v : variants) {
        Row row{v.name, by_success ? "Avg. success %" : "Inference time ms"};
        for (const int count : steps)
          row.push_back(by_success ? success(runs, {v.variant, count})
                                   : milliseconds(runs, {v.variant, count}));
        rows.push_back(row);
      }
    }
    return markdown(title, head, rows);
  };
  return table;
}

AblationTable table4(const TableChoice& choice) {
  AblationVariant cfm = base_of(choice), ddim = cfm;
  ddim.objective = "ddim";
  return steps_table("4", "Table 4: impact of inference steps", {{"DDIM", ddim}, {"CFM", cfm}},
                     steps_of(choice));
}

AblationTable table_c(const TableChoice& choice) {
  AblationVariant with = base_of(choice), without = with;
  without.radius = "off";
  return steps_table("C", "Table C: the DRS in few time steps",
                     {{"CFM w/o DRS", without}, {"CFM w DRS", with}}, steps_of(choice));
}

AblationTable table_precise(const TableChoice& choice) {
  AblationTable table{"precise", {}, {}};
  for (const char* objective : {"ddpm", "ddim", "cfm"}) {
    AblationVariant v = base_of(choice);
    v.objective = objective;
    for (const int count : v.objective == "ddpm" ? std::vector<int>{ddpm_steps} : steps_of(choice))
      table.cells.push_back({v, count});
  }
  table.markdown = [cells = table.cells, tasks = choice.tasks](const Runs& runs) {
    Row head{"T.O.", "i-steps", "Avg. success %"};
    head.insert(head.end(), tasks.begin(), tasks.end());
    std::vector<Row> rows;
    for (const AblationCell& cell : cells) {
      Row row{upper(cell.variant.objective), std::to_string(cell.flow_steps), success(runs, cell)};
      const auto s = summarise(runs, cell);
      for (const std::string& task : tasks) {
        const TaskScore* score = nullptr;
        for (std::size_t i = 0; s && i < s->tasks.size(); ++i)
          if (s->tasks[i].task == task) score = &s->tasks[i];
        row.push_back(score ? number("%.1f", 100.0 * score->successes / score->episodes) : "-");
      }
      rows.push_back(row);
    }
    return markdown("CFM in high-precision tasks", head, rows);
  };
  return table;
}

AblationTable labelled_rows(const std::string& name, const std::string& title,
                            const std::vector<std::pair<std::string, AblationCell>>& entries) {
  AblationTable table{name, {}, {}};
  for (const auto& [label, cell] : entries) table.cells.push_back(cell);
  table.markdown = [=](const Runs& runs) {
    std::vector<Row> rows;
    for (const auto& [label, cell] : entries) {
      const auto s = summarise(runs, cell);
      double mm = 0;
      for (std::size_t i = 0; s && i < s->tasks.size(); ++i)
        mm += s->tasks[i].position_mm / static_cast<double>(s->tasks.size());
      rows.push_back({label, std::to_string(cell.flow_steps), success(runs, cell),
                      s ? number("%.1f", 100.0 * s->first_attempts / s->episodes) : "-",
                      s ? number("%.1f", mm) : "-", milliseconds(runs, cell)});
    }
    return markdown(
        title,
        {"Policy", "i-steps", "Avg. success %", "First attempt %", "Position error mm", "Inference time ms"},
        rows);
  };
  return table;
}

AblationTable table_ours(const TableChoice& choice) {
  const int steps = choice.flow_steps.empty() ? our_steps : choice.flow_steps.front();
  std::vector<std::pair<std::string, AblationCell>> entries{{"all of it", {{}, steps}}};
  const auto without = [&](const char* label, bool AblationVariant::*part) {
    AblationVariant v;
    v.*part = false;
    entries.push_back({std::string("without ") + label, {v, steps}});
  };
  without("grounding (velocity from the action token)", &AblationVariant::grounded);
  without("binding of words and points", &AblationVariant::binding);
  without("one middle per part (mean shift at each point)", &AblationVariant::part_middles);
  without("rotations and shifts", &AblationVariant::move);
  without("recolouring all together", &AblationVariant::recolor);
  without("repainting part by part", &AblationVariant::repaint);
  without("moving things about", &AblationVariant::shuffle);
  AblationVariant cropped;
  cropped.crop = true;
  entries.push_back({"with pictures resized and cropped", {cropped, steps}});
  return labelled_rows("ours", "What this implementation adds, one part exchanged at a time", entries);
}

}  // namespace

std::optional<CellSummary> summarise(const std::vector<AblationRun>& runs, const AblationCell& cell) {
  CellSummary sum;
  for (const AblationRun& run : runs) {
    const AblationMeasure* measure = run.variant == cell.variant ? run.at(cell.flow_steps) : nullptr;
    if (!measure || !measure->failure.empty()) continue;
    int successes = 0, episodes = 0;
    for (const TaskScore& task : measure->tasks) {
      successes += task.successes;
      episodes += task.episodes;
      auto same = std::ranges::find(sum.tasks, task.task, &TaskScore::task);
      if (same == sum.tasks.end()) same = sum.tasks.insert(same, {task.task, 0, 0, 0, 0});
      same->successes += task.successes;
      same->episodes += task.episodes;
      same->first_attempts += task.first_attempts;
      sum.first_attempts += task.first_attempts;
      same->position_mm += task.position_mm;
    }
    if (episodes == 0) continue;
    sum.successes += successes;
    sum.episodes += episodes;
    sum.by_seed.push_back(static_cast<double>(successes) / episodes);
    sum.ms += measure->ms;
  }
  if (sum.by_seed.empty()) return std::nullopt;
  const auto seeds = static_cast<double>(sum.by_seed.size());
  sum.ms /= seeds;
  for (TaskScore& task : sum.tasks) task.position_mm /= seeds;
  std::tie(sum.low, sum.high) = wilson_interval(sum.successes, sum.episodes);
  return sum;
}

std::vector<AblationTable> make_tables(const TableChoice& choice) {
  std::vector<AblationTable> tables;
  for (const std::string& name : choice.names) {
    if (name == "3")
      tables.push_back(table3(choice));
    else if (name == "4")
      tables.push_back(table4(choice));
    else if (name == "C")
      tables.push_back(table_c(choice));
    else if (name == "precise")
      tables.push_back(table_precise(choice));
    else if (name == "ours")
      tables.push_back(table_ours(choice));
    else
      throw std::invalid_argument("no table is called '" + name + "'; there are: 3, 4, C, precise, ours");
  }
  return tables;
}

AblationTable make_cell_table(const std::string& title, const std::vector<AblationCell>& cells) {
  std::vector<std::pair<std::string, AblationCell>> entries;
  for (const AblationCell& cell : cells) {
    const std::pair entry{key_of(cell.variant), cell};
    if (std::ranges::find(entries, entry) == entries.end()) entries.push_back(entry);
  }
  return labelled_rows("cells", title, entries);
}

}  // namespace flowscope
