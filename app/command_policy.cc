// flowscope policy: what a policy is, and its weights out to other programs and in from them.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/cli.h"
#include "app/commands.h"
#include "policy/clip/convert.h"
#include "policy/preset_fields.h"
#include "policy/summary.h"
#include "policy/weights_io.h"

namespace flowscope::app {
namespace {

using Json = nlohmann::ordered_json;

struct ShowCall {
  std::filesystem::path file;
  std::string preset, backbone = "mamba";
};

struct ConvertCall {
  std::filesystem::path in, out;
  ClipConvertOptions clip;
};

Json as_json(const Work& work) { return {{"products", work.products}, {"recurrences", work.recurrences}}; }

Json as_json(const PolicySummary& s) {
  Json shape, parts = Json::array();
  const auto put = [&shape](const char* name, const auto& value) { shape[name] = value; };
  visit_shape(s.shape, put);
  visit_later_shape(s.shape, put);
  for (const PartSummary& part : s.parts)
    parts.push_back(
        {{"name", part.name},
         {"parameters", part.parameters},
         {"multiply_adds", {{"scene", as_json(part.work.scene)}, {"step", as_json(part.work.step)}}}});
  const auto numbers = [](const Eigen::Vector3d& v) { return Json{v.x(), v.y(), v.z()}; };
  return {{"preset", s.preset},
          {"backbone", s.backbone},
          {"objective", s.objective},
          {"shape", shape},
          {"radius", {{"kind", s.radius.kind}, {"r_0_m", s.radius.r_0}, {"r_min_m", s.radius.r_min}}},
          {"bounds", {{"min", numbers(s.bounds.min)}, {"max", numbers(s.bounds.max)}}},
          {"words", s.words},
          {"steps", s.steps},
          {"minutes", s.minutes},
          {"demonstrations", s.demonstrations ? Json(s.demonstrations) : Json()},
          {"parameters", s.parameters},
          {"multiply_adds", {{"scene", as_json(s.scene)}, {"step", as_json(s.step)}}},
          {"parts", parts}};
}

double million(const Work& work) { return static_cast<double>(work.products + work.recurrences) / 1e6; }

const char* order_of(const NetworkShape& shape) {
  return shape.paper_order ? "paper" : shape.stored_state ? "stored" : "carried";
}

void print(const PolicySummary& s) {
  std::printf("preset %s, backbone %s, objective %s, %s form, %s token order\n", s.preset.c_str(),
              s.backbone.c_str(), s.objective.c_str(), s.shape.grounded ? "grounded" : "the paper's",
              order_of(s.shape));
  std::printf("%d channels, %d states, %d image and %d region tokens, %d words\n", s.shape.channels,
              s.shape.d_state, s.shape.image_tokens, s.shape.region_points, s.shape.words);
  std::printf("radius %s, from %.3f to %.3f m\n", s.radius.kind.c_str(), s.radius.r_0, s.radius.r_min);
  if (s.steps > 0) {
    std::printf("trained %lld steps in %.1f minutes", static_cast<long long>(s.steps), s.minutes);
    if (s.demonstrations > 0) std::printf(" on %d demonstrations", s.demonstrations);
    std::printf("; %zu words known\n", s.words.size());
    const auto &a = s.bounds.min, &b = s.bounds.max;
    std::printf("keyframes within x %.3f to %.3f, y %.3f to %.3f, z %.3f to %.3f m\n", a.x(), b.x(), a.y(),
                b.y(), a.z(), b.z());
  }
  std::printf("\n%-16s %12s %18s %18s\n", "part", "parameters", "M madds / scene", "M madds / step");
  for (const PartSummary& part : s.parts)
    std::printf("%-16s %12lld %18.3f %18.3f\n", part.name.c_str(), static_cast<long long>(part.parameters),
                million(part.work.scene), million(part.work.step));
  std::printf("%-16s %12lld %18.3f %18.3f\n", "all", static_cast<long long>(s.parameters), million(s.scene),
              million(s.step));
}

int show(const ShowCall& call, const Context& context) {
  if (call.file.empty() == call.preset.empty()) throw UsageError("FILE or --preset says which policy");
  PolicySummary summary;
  try {
    summary =
        call.preset.empty() ? summarise_policy(call.file) : summarise_preset(call.preset, call.backbone);
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
  if (context.json)
    print_json(as_json(summary));
  else
    print(summary);
  return 0;
}

void report(const Context& context, const Json& document, const std::string& line) {
  if (context.json)
    print_json(document);
  else
    std::printf("%s\n", line.c_str());
}

int convert_clip_weights(const ClipConvertOptions& options, const Context& context) {
  const ClipConverted made = convert_clip(options);
  report(context,
         {{"out", options.out.string()},
          {"identity", made.identity},
          {"image_parameters", made.image_parameters},
          {"text_parameters", made.text_parameters}},
         options.out.string() + ": " + std::to_string(made.image_parameters) +
             " parameters for pictures and " + std::to_string(made.text_parameters) + " for text, identity " +
             made.identity);
  return 0;
}

int convert(const ConvertCall& call, const Context& context) {
  const bool clip = !call.clip.image.empty() || !call.clip.text.empty();
  if (clip && !call.in.empty()) throw UsageError("IN and --clip-image or --clip-text exclude each other");
  try {
    if (clip) {
      if (call.clip.out.empty()) throw UsageError("--out says where CLIP's weights go");
      return convert_clip_weights(call.clip, context);
    }
    if (call.in.empty() || call.out.empty())
      throw UsageError("IN and OUT are missing: x.policy y.safetensors, or the other way");
    if (call.out.extension() == ".safetensors")
      export_weights(call.in, call.out);
    else if (call.in.extension() == ".safetensors")
      import_weights(call.in, call.out);
    else
      throw UsageError("one of IN and OUT must end in .safetensors");
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
  report(context, {{"in", call.in.string()}, {"out", call.out.string()}}, call.out.string());
  return 0;
}

void add_show(CLI::App& policy, Context& context) {
  CLI::App* command =
      policy.add_subcommand("show", "Sizes, statistics, parameters and the cost of a prediction");
  auto call = std::make_shared<ShowCall>();
  CLI::Option* file = command->add_option("file", call->file, "Trained policy");
  command->add_option("--preset", call->preset, "Instead: a preset")
      ->check(CLI::IsMember({"nano", "desk", "paper"}))
      ->excludes(file);
  command->add_option("--backbone", call->backbone, "Sequence model of the preset")
      ->check(CLI::IsMember({"mamba", "transformer"}))
      ->excludes(file)
      ->capture_default_str();
  add_json_option(*command, context);
  set_body(*command, context, [call, &context] { return show(*call, context); });
}

void add_convert(CLI::App& policy, Context& context) {
  CLI::App* command = policy.add_subcommand(
      "convert", "Weights to safetensors and back, and CLIP's published weights to ours");
  auto call = std::make_shared<ConvertCall>();
  command->add_option("in", call->in, "Policy or .safetensors");
  command->add_option("to", call->out, "The other of the two");
  command->add_option("--clip-image", call->clip.image, "CLIP ResNet-50 as published, or as safetensors");
  command->add_option("--clip-text", call->clip.text, "CLIP with the text transformer of width 512");
  command->add_option("--clip-merges", call->clip.merges, "Its list of merges");
  command->add_option("--out", call->clip.out, "File for CLIP's weights");
  add_json_option(*command, context);
  set_body(*command, context, [call, &context] { return convert(*call, context); });
}

}  // namespace

void add_policy_command(CLI::App& root, Context& context) {
  CLI::App* command =
      root.add_subcommand("policy", "Look into a policy, and exchange weights with other programs");
  command->require_subcommand(1);
  add_show(*command, context);
  add_convert(*command, context);
}

}  // namespace flowscope::app
