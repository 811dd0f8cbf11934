#include "recorder/demo_header.h"

#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

namespace flowscope {
namespace {

using Json = nlohmann::ordered_json;

// Far above any real demonstration; what they bound is the memory that a crafted file can ask for.
constexpr std::uint64_t max_frames = 100'000, max_keyframes = 1'000, max_views = 16, max_side = 4'096;
constexpr std::uint64_t max_state_values = 100'000, max_block_bytes = 1ull << 30;
constexpr std::size_t max_name = 255, max_path = 4'096, sha256_digits = 64;

Json to_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json to_json(const CameraModel& camera) {
  const Eigen::Vector4d wxyz = camera.world_from_camera.wxyz();
  return {{"camera", camera.name},
          {"width", camera.width},
          {"height", camera.height},
          {"fx", camera.fx},
          {"fy", camera.fy},
          {"cx", camera.cx},
          {"cy", camera.cy},
          {"near_m", camera.near_m},
          {"far_m", camera.far_m},
          {"position", to_json(camera.world_from_camera.position)},
          {"quaternion", {wxyz[0], wxyz[1], wxyz[2], wxyz[3]}}};
}

Json to_json(const ViewLayout& view) {
  Json json = to_json(view.camera);
  json["depth_unit_m"] = view.depth_unit_m;
  json["rgb_bytes"] = view.rgb_bytes;
  json["depth_bytes"] = view.depth_bytes;
  return json;
}

/// A value inside the header together with its path, so that a complaint can name the place.
class Node {
 public:
  Node(const Json& json, std::string place) : json_(json), place_(std::move(place)) {}

  Node operator[](const char* key) const {
    if (!json_.is_object() || !json_.contains(key)) fail(std::string("lacks \"") + key + "\"");
    return {json_.at(key), place_ + "." + key};
  }
  /// None where the key is missing: older files do not have it.
  std::optional<Node> find(const char* key) const {
    if (!json_.is_object() || !json_.contains(key)) return std::nullopt;
    return (*this)[key];
  }
  std::vector<Node> items(std::uint64_t max_count) const {
    if (!json_.is_array()) fail("is not a list");
    if (json_.size() > max_count) fail("has more than " + std::to_string(max_count) + " entries");
    std::vector<Node> nodes;
    for (std::size_t i = 0; i < json_.size(); ++i) {
      nodes.emplace_back(json_[i], place_ + "[" + std::to_string(i) + "]");
    }
    return nodes;
  }
  std::string text() const {
    if (!json_.is_string()) fail("is not text");
    return json_.get<std::string>();
  }
  std::string text(std::size_t max_size) const {
    std::string value = text();
    if (value.size() > max_size) fail("has more than " + std::to_string(max_size) + " characters");
    return value;
  }
  /// Hexadecimal digits, or nothing.
  std::string sha256() const {
    const std::string value = text(sha256_digits);
    const bool hex = value.find_first_not_of("0123456789abcdef") == std::string::npos;
    if (!hex || (!value.empty() && value.size() != sha256_digits)) fail("is not a SHA-256");
    return value;
  }
  bool truth() const {
    if (!json_.is_boolean()) fail("is neither true nor false");
    return json_.get<bool>();
  }
  double number() const {
    if (!json_.is_number()) fail("is not a number");
    return json_.get<double>();
  }
  std::uint64_t count(std::uint64_t max_value) const {
    if (!json_.is_number_unsigned()) fail("is not a whole number");
    const auto value = json_.get<std::uint64_t>();
    if (value > max_value) fail("is above " + std::to_string(max_value));
    return value;
  }
  Eigen::Vector3d vector3() const {
    const std::vector<Node> nodes = items(3);
    if (nodes.size() != 3) fail("has not three entries");
    return {nodes[0].number(), nodes[1].number(), nodes[2].number()};
  }
  Eigen::Quaterniond quaternion_wxyz() const {
    const std::vector<Node> nodes = items(4);
    if (nodes.size() != 4) fail("has not four entries");
    return {nodes[0].number(), nodes[1].number(), nodes[2].number(), nodes[3].number()};
  }
  [[noreturn]] void fail(const std::string& problem) const {
    throw std::runtime_error(place_ + " " + problem);
  }

 private:
  const Json& json_;
  std::string place_;
};

ViewLayout parse_view(const Node& node) {
  ViewLayout view;
  CameraModel& camera = view.camera;
  camera.name = node["camera"].text();
  camera.width = static_cast<int>(node["width"].count(max_side));
  camera.height = static_cast<int>(node["height"].count(max_side));
  camera.fx = node["fx"].number();
  camera.fy = node["fy"].number();
  camera.cx = node["cx"].number();
  camera.cy = node["cy"].number();
  camera.near_m = node["near_m"].number();
  camera.far_m = node["far_m"].number();
  camera.world_from_camera = {node["position"].vector3(), node["quaternion"].quaternion_wxyz()};
  view.depth_unit_m = node["depth_unit_m"].number();
  view.rgb_bytes = node["rgb_bytes"].count(max_block_bytes);
  view.depth_bytes = node["depth_bytes"].count(max_block_bytes);
  return view;
}

template <typename Layout>
auto state_fields(Layout& state) {
  using Field = std::pair<const char*, decltype(&state.qpos)>;
  return std::array<Field, 10>{{{"qpos", &state.qpos},
                                {"qvel", &state.qvel},
                                {"act", &state.act},
                                {"ctrl", &state.ctrl},
                                {"qacc_warmstart", &state.qacc_warmstart},
                                {"mocap_pos", &state.mocap_pos},
                                {"mocap_quat", &state.mocap_quat},
                                {"eq_active", &state.eq_active},
                                {"eq_data", &state.eq_data},
                                {"mat_rgba", &state.mat_rgba}}};
}

DemoOrigin parse_origin(const Node& root) {
  DemoOrigin origin;
  if (const auto robot = root.find("robot")) {
    origin.robot = (*robot)["name"].text(max_name);
    origin.joints = static_cast<int>((*robot)["joints"].count(Frame().q.size()));
    if (origin.robot.empty()) (*robot)["name"].fail("is empty");
    if (origin.joints == 0) (*robot)["joints"].fail("is 0");
  }
  if (const auto scene = root.find("scene")) {
    const Node& from = *scene;
    origin.scene = {from["file"].text(max_path), from["robot"].text(max_path), from["folder"].text(max_path),
                    from["sha256"].sha256(), from["robot_sha256"].sha256()};
    if (const auto key = from.find("key")) origin.scene->key = key->text(max_name);
    if (origin.scene->scene.empty()) from["file"].fail("is empty");
    if (origin.scene->scene_sha256.empty()) from["sha256"].fail("is empty");
  }
  return origin;
}

/// Only what is known: a file of an older build, read and written again, stays the same.
void put_origin(const DemoInfo& info, Json& json) {
  const DemoOrigin& origin = info.origin;
  if (!origin.robot.empty()) json["robot"] = {{"name", origin.robot}, {"joints", origin.joints}};
  if (const auto& scene = origin.scene) {
    json["scene"] = {{"file", scene->scene},
                     {"robot", scene->robot},
                     {"folder", scene->folder},
                     {"sha256", scene->scene_sha256},
                     {"robot_sha256", scene->robot_sha256}};
    if (!scene->key.empty()) json["scene"]["key"] = scene->key;
  }
  if (info.success) json["success"] = *info.success;
}

DemoHeader parse(const Node& root) {
  DemoHeader header;
  DemoInfo& info = header.info;
  info.task = root["task"].text();
  info.variation = static_cast<int>(root["variation"].count(1'000'000));
  info.seed = root["seed"].count(UINT64_MAX);
  info.created = root["created"].text();
  info.frames = static_cast<int>(root["frames"].count(max_frames));
  header.simulator = root["simulator"].text();
  info.origin = parse_origin(root);
  if (const auto success = root.find("success")) info.success = success->truth();
  for (const Node& node : root["instructions"].items(1'000)) header.instructions.push_back(node.text());
  if (!header.instructions.empty()) info.instruction = header.instructions.front();
  header.bounds = {root["bounds"]["min"].vector3(), root["bounds"]["max"].vector3()};
  const Node state = root["state"];
  header.state.scene = state["scene"].text();
  for (auto [name, field] : state_fields(header.state)) *field = state[name].count(max_state_values);
  if (header.state.bytes() * info.frames > max_block_bytes) state.fail("is too large");
  header.states_bytes = root["states_bytes"].count(max_block_bytes);
  for (const Node& node : root["keyframes"].items(max_keyframes)) {
    header.keyframes.push_back(static_cast<int>(node.count(max_frames)));
  }
  info.keyframes = static_cast<int>(header.keyframes.size());
  std::uint64_t pixels = 0;
  for (const Node& node : root["observations"].items(max_keyframes + 1)) {
    std::vector<ViewLayout>& views = header.observations.emplace_back();
    for (const Node& view : node.items(max_views)) {
      views.push_back(parse_view(view));
      pixels += static_cast<std::uint64_t>(views.back().camera.width) * views.back().camera.height;
      if (pixels > max_block_bytes / 8) view.fail("brings more pixels than a demonstration may have");
    }
  }
  if (header.observations.size() != header.keyframes.size() + 1) {
    root["observations"].fail("has not one entry for the start and one for each keyframe");
  }
  return header;
}

}  // namespace

std::uint64_t StateLayout::bytes() const {
  const std::uint64_t doubles =
      1 + qpos + qvel + act + ctrl + qacc_warmstart + mocap_pos + mocap_quat + eq_data;
  return doubles * sizeof(double) + mat_rgba * sizeof(float) + eq_active;
}

std::string to_json_text(const DemoHeader& header) {
  Json state{{"scene", header.state.scene}};
  for (const auto& [name, field] : state_fields(header.state)) state[name] = *field;
  Json observations = Json::array();
  for (const std::vector<ViewLayout>& layouts : header.observations) {
    Json views = Json::array();
    for (const ViewLayout& layout : layouts) views.push_back(to_json(layout));
    observations.push_back(std::move(views));
  }
  Json json{{"task", header.info.task},
            {"variation", header.info.variation},
            {"seed", header.info.seed},
            {"created", header.info.created},
            {"simulator", header.simulator}};
  put_origin(header.info, json);
  json["frames"] = header.info.frames;
  json["instructions"] = header.instructions;
  json["bounds"] = {{"min", to_json(header.bounds.min)}, {"max", to_json(header.bounds.max)}};
  json["state"] = std::move(state);
  json["states_bytes"] = header.states_bytes;
  json["keyframes"] = header.keyframes;
  json["observations"] = std::move(observations);
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string to_json_text(const CameraModel& camera) {
  return to_json(camera).dump(-1, ' ', false, Json::error_handler_t::replace);
}

DemoHeader parse_demo_header(const std::string& text) {
  const Json json = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded()) throw std::runtime_error("header is not JSON");
  return parse(Node(json, "header"));
}

}  // namespace flowscope
