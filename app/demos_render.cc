// flowscope demos render: what any camera would have seen, drawn from the stored states.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>

#include "app/demo_tasks.h"
#include "app/demos_command.h"
#include "app/progress.h"
#include "recorder/demo_header.h"
#include "render/depth_png.h"
#include "render/encode.h"
#include "render/new_file.h"
#include "render/renderer.h"

namespace flowscope::app {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kFramesPerSecond = 20;  // as recorded

struct RenderCall {
  std::string id, camera = "front";
  std::filesystem::path out;
  int width = 640, height = 480;
  int frame = -1;
  bool keyframes = false, all = false, depth = false;
  OrbitCamera orbit;
  std::vector<double> lookat;  ///< x, y, z; empty: the orbit's own
  DemoScenes scenes;
};

bool is_film(const RenderCall& call) { return call.out.extension() == ".mp4"; }

std::vector<int> frames_of(const RenderCall& call, const Demo& demo) {
  const int count = static_cast<int>(demo.frames.size());
  if (call.frame >= count) {
    throw UsageError("--frame: " + demo.info.id + " has frames 0 to " + std::to_string(count - 1));
  }
  if (call.frame >= 0) return {call.frame};
  std::vector<int> frames;
  if (call.all || (is_film(call) && !call.keyframes)) {
    for (int i = 0; i < count; ++i) frames.push_back(i);
  } else {
    frames.push_back(0);
    for (const Keyframe& keyframe : demo.keyframes) frames.push_back(keyframe.frame);
  }
  return frames;
}

CameraModel camera_of(const RenderCall& call, Renderer& renderer, const SceneState& state) {
  if (call.camera == "orbit") return call.orbit.model(call.width, call.height);
  try {
    return renderer.camera(state, call.camera, call.width, call.height);
  } catch (const std::invalid_argument& error) {
    throw UsageError("--camera: " + std::string(error.what()));
  }
}

std::string numbered(const char* what, int frame) {
  char name[48];
  std::snprintf(name, sizeof name, "%s-%05d.png", what, frame);
  return name;
}

/// The pictures of one call: without keep() those that were written go again.
class Pictures {
 public:
  explicit Pictures(const std::filesystem::path& folder) : made_(folder, folder) {}
  ~Pictures() {
    std::error_code ignored;
    for (const auto& file : written_) std::filesystem::remove(file, ignored);
  }
  Pictures(const Pictures&) = delete;
  Pictures& operator=(const Pictures&) = delete;
  void add(const std::filesystem::path& file) { written_.push_back(file); }
  void keep() {
    made_.keep();
    written_.clear();
  }

 private:
  NewFolders made_;
  std::vector<std::filesystem::path> written_;
};

/// Writes the pictures of one frame and tells where they are.
Json write_frame(const RenderCall& call, Renderer& renderer, const SceneState& state, int frame,
                 Pictures& pictures) {
  const CameraModel camera = camera_of(call, renderer, state);
  const auto picture = call.out / numbered("frame", frame);
  Json entry{{"frame", frame}, {"picture", picture.string()}};
  if (call.depth) {
    const View view = renderer.observe(state, camera);
    const auto depth = call.out / numbered("depth", frame);
    write_png(picture, view.rgb);
    pictures.add(picture);
    write_depth_png(depth, view.depth);
    pictures.add(depth);
    entry["depth"] = depth.string();
  } else {
    write_png(picture, renderer.draw(state, camera));
    pictures.add(picture);
  }
  entry["camera"] = Json::parse(to_json_text(camera));
  entry["camera"]["name"] = camera.name;
  return entry;
}

int render(RenderCall call, const Context& context) {
  if (call.depth && is_film(call)) throw UsageError("--depth: goes with pictures in a folder, not a film");
  if (!call.lookat.empty()) call.orbit.lookat = {call.lookat[0], call.lookat[1], call.lookat[2]};
  const DemoStore store = open_store(context);
  const Demo demo = with_known_id([&] { return store.load(call.id); });
  const std::vector<int> frames = frames_of(call, demo);
  DemoTasks tasks(call.scenes);
  const std::shared_ptr<const Task> task = tasks.get(demo.info);
  RendererOptions options;
  options.max_width = call.width;
  options.max_height = call.height;
  options.samples = call.depth ? 0 : 4;  // depth must not be a mixture of what lies before and behind an edge
  Renderer renderer(task->model(), task->name(), options);
  Json files = Json::array();
  {
    Progress progress("frame", static_cast<int>(frames.size()));
    std::optional<Mp4Writer> film;
    std::optional<Pictures> pictures;
    if (is_film(call)) {
      film.emplace(call.out, call.width, call.height, kFramesPerSecond);
    } else {
      pictures.emplace(call.out);
    }
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const SceneState& state = demo.frames[static_cast<std::size_t>(frames[i])].state;
      if (film) {
        film->add(renderer.draw(state, camera_of(call, renderer, state)));
      } else {
        files.push_back(write_frame(call, renderer, state, frames[i], *pictures));
      }
      progress.report(static_cast<int>(i) + 1, "frame " + std::to_string(frames[i]));
    }
    if (film) film->finish();
    if (pictures) pictures->keep();
  }
  if (context.json) {
    print_json({{"id", call.id}, {"out", call.out.string()}, {"frames", frames.size()}, {"files", files}});
  } else {
    std::printf("%zu frames in %s\n", frames.size(), call.out.c_str());
  }
  return 0;
}

void add_orbit_options(CLI::App& command, RenderCall& call) {
  command.add_option("--azimuth-deg", call.orbit.azimuth_deg, "Of the orbit, about the world's z")
      ->capture_default_str();
  command.add_option("--elevation-deg", call.orbit.elevation_deg, "Of the orbit; negative looks down")
      ->check(CLI::Range(-90.0, 90.0))
      ->capture_default_str();
  command.add_option("--distance-m", call.orbit.distance_m, "Of the orbit")
      ->check(CLI::Range(0.05, 50.0))
      ->capture_default_str();
  command.add_option("--lookat", call.lookat, "Middle of the orbit, x y z in metres")->expected(3);
}

}  // namespace

void add_demos_render(CLI::App& demos, Context& context) {
  CLI::App* command = add_demos_part(demos, context, "render",
                                     "Draw a demonstration anew, through any camera, at any size: pictures "
                                     "into a folder or a film");
  auto call = std::make_shared<RenderCall>();
  command->add_option("id", call->id, "Which one")->required()->type_name("ID");
  command->add_option("--out", call->out, "Folder for PNG pictures, or a file that ends in .mp4")
      ->required()
      ->type_name("DIR|FILE.mp4");
  command->add_option("--camera", call->camera, "A camera of the scene by its name, or orbit")
      ->type_name("NAME|orbit")
      ->capture_default_str();
  command->add_option("--width", call->width, "Pixels")->check(CLI::Range(16, 4096))->capture_default_str();
  command->add_option("--height", call->height, "Pixels")->check(CLI::Range(16, 4096))->capture_default_str();
  CLI::Option* frame =
      command->add_option("--frame", call->frame, "Only this frame")->check(CLI::NonNegativeNumber);
  CLI::Option* keyframes = command->add_flag("--keyframes", call->keyframes,
                                             "The start and every keyframe (what a folder gets by default)");
  CLI::Option* all = command->add_flag("--all", call->all, "Every frame (what a film gets by default)");
  frame->excludes(keyframes, all);
  keyframes->excludes(all);
  command->add_flag(
      "--depth", call->depth,
      "Depth beside each picture: 16-bit PNG, millimetres along the camera's axis, 0 for no hit");
  add_orbit_options(*command, *call);
  add_demo_scene_options(*command, call->scenes);
  add_egl_option(*command, context);
  set_body(*command, context, [call, &context] { return render(*call, context); });
}

}  // namespace flowscope::app
