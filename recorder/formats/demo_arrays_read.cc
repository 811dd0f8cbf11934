#include <algorithm>
#include <map>

#include "recorder/formats/demo_array_parts.h"

namespace flowscope {
namespace {

using Numbers = std::vector<double>;

constexpr std::uint64_t max_array_bytes = 2ull << 30;

std::uint64_t width_of(const StateLayout& layout, const std::string& name) {
  const std::map<std::string, std::uint64_t> widths{{"qpos", layout.qpos},
                                                    {"qvel", layout.qvel},
                                                    {"act", layout.act},
                                                    {"ctrl", layout.ctrl},
                                                    {"mocap_pos", layout.mocap_pos},
                                                    {"qacc_warmstart", layout.qacc_warmstart},
                                                    {"eq_data", layout.eq_data},
                                                    {"mocap_quat", layout.mocap_quat},
                                                    {"mat_rgba", layout.mat_rgba},
                                                    {"eq_active", layout.eq_active}};
  return widths.at(name.substr(name.find('/') + 1));
}

/// Reads arrays by name, each checked against the size that the header promises.
class Source {
 public:
  explicit Source(const FetchArray& fetch) : fetch_(fetch) {}

  template <Plain T>
  std::vector<T> values(const std::string& name, std::vector<std::uint64_t> shape) const {
    const ArraySpec spec{array_type_of<T>(), std::move(shape)};
    if (spec.bytes() > max_array_bytes)
      throw std::runtime_error(name + " is larger than any demonstration's");
    const NamedArray array = fetch_(name, spec);
    std::vector<T> result(array.data.size() / sizeof(T));
    ByteReader(array.data).get_all<T>(result);
    return result;
  }
  std::string text(const std::string& name) const {
    const NamedArray array = fetch_(name, {});
    return {array.data.begin(), array.data.end()};
  }

 private:
  const FetchArray& fetch_;
};

Pose pose_at(const Numbers& positions, const Numbers& wxyz, std::size_t i) {
  const double *p = &positions[3 * i], *q = &wxyz[4 * i];
  return {{p[0], p[1], p[2]}, Eigen::Quaterniond(q[0], q[1], q[2], q[3])};
}

DemoHeader read_header(const Source& source, const std::string& place) {
  const std::string text = source.text("header");
  try {
    const DemoHeader header = parse_demo_header(text);
    require_same_cameras<std::runtime_error>(header);
    return header;
  } catch (const std::exception& error) {
    throw std::runtime_error(place + error.what());
  }
}

void read_frames(const Source& source, const DemoHeader& header, std::vector<Frame>& frames) {
  const std::uint64_t count = static_cast<std::uint64_t>(header.info.frames),
                      joints = stored_joints(header.info);
  frames.resize(count);
  const Numbers time = source.values<double>("frame/time_s", {count});
  const Numbers q = source.values<double>("frame/q", {count, joints});
  const Numbers dq = source.values<double>("frame/dq", {count, joints});
  const Numbers openness = source.values<double>("frame/openness", {count});
  const Bytes gripper_open = source.values<std::uint8_t>("frame/gripper_open", {count});
  const Numbers position = source.values<double>("frame/tool_position", {count, 3});
  const Numbers wxyz = source.values<double>("frame/tool_quaternion", {count, 4});
  const Numbers state_time = source.values<double>("state/time_s", {count});
  for (std::size_t i = 0; i < count; ++i) {
    Frame& f = frames[i];
    f.time_s = time[i];
    std::copy_n(&q[joints * i], joints, f.q.begin());
    std::copy_n(&dq[joints * i], joints, f.dq.begin());
    f.openness = openness[i];
    f.gripper_open = gripper_open[i] != 0;
    f.world_from_tool = pose_at(position, wxyz, i);
    f.state.scene = header.state.scene;
    f.state.time_s = state_time[i];
  }
  for_each_state_part([&](const std::string& name, auto part) {
    using T = typename std::decay_t<decltype(SceneState{}.*part)>::value_type;
    const std::uint64_t width = width_of(header.state, name);
    const std::vector<T> values = source.values<T>(name, {count, width});
    for (std::size_t i = 0; i < count; ++i) {
      const auto begin = values.begin() + static_cast<std::ptrdiff_t>(width * i);
      (frames[i].state.*part).assign(begin, begin + static_cast<std::ptrdiff_t>(width));
    }
  });
}

void read_keyframes(const Source& source, const DemoHeader& header, const std::string& place,
                    std::vector<Keyframe>& keyframes) {
  const std::uint64_t count = header.keyframes.size();
  keyframes.resize(count);
  if (count == 0) return;
  const auto frame = source.values<std::int32_t>("keyframe/frame", {count});
  const Numbers position = source.values<double>("keyframe/position", {count, 3});
  const Numbers wxyz = source.values<double>("keyframe/quaternion", {count, 4});
  const Numbers openness = source.values<double>("keyframe/openness", {count});
  for (std::size_t k = 0; k < count; ++k) {
    if (frame[k] < 0 || frame[k] >= header.info.frames) {
      throw std::runtime_error(place + "keyframe/frame[" + std::to_string(k) + "]: there is no frame " +
                               std::to_string(frame[k]));
    }
    keyframes[k].frame = frame[k];
    keyframes[k].action = {pose_at(position, wxyz, k), openness[k]};
  }
}

Observation blank(const std::vector<ViewLayout>& layouts) {
  Observation observation;
  for (const ViewLayout& layout : layouts) {
    const CameraModel& camera = layout.camera;
    observation.views.push_back(
        {camera, ImageRgb(camera.width, camera.height), DepthImage(camera.width, camera.height)});
  }
  return observation;
}

void read_pictures(const Source& source, const std::vector<Observation*>& observations) {
  const std::uint64_t count = observations.size();
  for (std::size_t v = 0; v < observations.front()->views.size(); ++v) {
    const CameraModel& camera = observations.front()->views[v].camera;
    const std::string name = "observation/" + camera.name;
    const auto height = static_cast<std::uint64_t>(camera.height),
               width = static_cast<std::uint64_t>(camera.width);
    const Bytes rgb = source.values<std::uint8_t>(name + "_rgb", {count, height, width, 3});
    const std::vector<float> depth = source.values<float>(name + "_depth", {count, height, width});
    for (std::size_t k = 0; k < count; ++k) {
      View& view = observations[k]->views[v];
      const std::size_t pixels = height * width;
      std::copy_n(rgb.begin() + static_cast<std::ptrdiff_t>(3 * pixels * k), 3 * pixels,
                  view.rgb.data.begin());
      std::copy_n(depth.begin() + static_cast<std::ptrdiff_t>(pixels * k), pixels, view.depth.data.begin());
    }
  }
}

}  // namespace

Demo demo_from_arrays(const FetchArray& fetch, ArrayParts parts, const std::string& place) {
  const Source source(fetch);
  const DemoHeader header = read_header(source, place);
  Demo demo;
  demo.info = header.info;
  demo.simulator = header.simulator;
  demo.instructions = header.instructions;
  demo.bounds = header.bounds;
  read_frames(source, header, demo.frames);
  read_keyframes(source, header, place, demo.keyframes);
  demo.start = blank(header.observations.front());
  std::vector<Observation*> observations{&demo.start};
  for (std::size_t k = 0; k < demo.keyframes.size(); ++k) {
    demo.keyframes[k].observation = blank(header.observations[k + 1]);
    observations.push_back(&demo.keyframes[k].observation);
  }
  if (parts == ArrayParts::all) read_pictures(source, observations);
  return demo;
}

}  // namespace flowscope
