#include "policy/sample.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "policy/picture_crop.h"
#include "policy/recolor.h"
#include "policy/things.h"

namespace flowscope {
namespace {

RobotState state_at(const Demo& demo, int frame) {
  const Frame& f = demo.frames.at(static_cast<std::size_t>(frame));
  return {f.world_from_tool, f.openness, f.q};
}

void change_colors(PreparedScene& scene, std::vector<Word>& words, const Augmentation& kinds,
                   Random& random) {
  const bool repainted = kinds.repaint && random.uniform() < 0.7 && repaint_parts(scene, words, random);
  if (!repainted && kinds.recolor && random.uniform() < 0.7) turn_colors(scene, words, random);
}

// Joints and the way so far tell few demonstrations apart better than any picture: a network that sees them
// sharply learns each one's next move by heart. The pose now stays exact, for moves that are meant relative
// to it.
void blur_past(std::array<RobotState, history_length>& history, Random& random) {
  constexpr double past_shift_m = 0.15, joint_noise_rad = 0.3;
  for (std::size_t i = 0; i < history.size(); ++i) {
    for (double& q : history[i].q) q += joint_noise_rad * random.normal();
    if (i + 1 == history.size()) continue;
    for (int a = 0; a < 3; ++a)
      history[i].world_from_tool.position[a] += random.uniform(-past_shift_m, past_shift_m);
  }
}

// Whether a target that turns along with its thing still is the one of several equal turns that an expert
// would take: those nearest to the tool's own yaw.
bool turn_stays_nearest(const Pose& target, const Pose& tool, double yaw_rad) {
  const Eigen::Quaterniond between = target.rotation * tool.rotation.conjugate();
  const double before = std::remainder(2 * std::atan2(between.z(), between.w()), 2 * std::numbers::pi);
  const double after = std::abs(std::remainder(before + yaw_rad, 2 * std::numbers::pi));
  return after < std::numbers::pi / 4 || after < std::abs(before);
}

Pose pose_of(const ThingMove& move) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(move.yaw_rad, Eigen::Vector3d::UnitZ()));
  const Eigen::Vector3d pivot = move.pivot.cast<double>();
  return {pivot + move.shift.cast<double>() - turn * pivot, turn};
}

void move_point(ScenePoint& p, const Pose& moved_from_world, double yaw_rad) {
  const Eigen::Matrix3f rotation = moved_from_world.rotation.toRotationMatrix().cast<float>();
  const Eigen::Vector3f offset = moved_from_world.position.cast<float>();
  p.position = rotation * p.position + offset;
  p.normal = rotation * p.normal;
  p.around = moved(p.around, static_cast<float>(yaw_rad), offset);
}

// The same task with its things elsewhere: the target goes along with the thing that it is about.
void move_things(PreparedScene& scene, GripperAction& target, const Pose& tool, double range_m,
                 Random& random) {
  std::vector<Eigen::Vector3f> position;
  for (const ScenePoint& p : scene.points) position.push_back(p.position);
  const Eigen::Vector3f place = target.world_from_tool.position.cast<float>();
  const int about = thing_at(position, scene.thing, scene.plane_z, place);
  if (about < 0) return;  // nobody knows what it goes along with
  std::vector<ThingMove> moves = shuffle_things(
      position, scene.thing, scene.plane_z, tool.position.cast<float>(), static_cast<float>(range_m), random);
  ThingMove& own = moves[static_cast<std::size_t>(about)];
  if (!turn_stays_nearest(target.world_from_tool, tool, own.yaw_rad)) own.yaw_rad = 0;
  std::vector<Pose> poses;
  for (const ThingMove& m : moves) poses.push_back(pose_of(m));
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    if (scene.thing[i] < 0) continue;
    const auto id = static_cast<std::size_t>(scene.thing[i]);
    move_point(scene.points[i], poses[id], moves[id].yaw_rad);
  }
  target.world_from_tool = poses[static_cast<std::size_t>(about)] * target.world_from_tool;
}

// Which points were measured is chance: a network that always sees the same ones knows the demonstration by
// them.
void drop_points(PreparedScene& scene, Random& random) {
  const double keep = random.uniform(0.8, 1.0);
  std::size_t to = 0, patches = 0;
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    if (i > 0 && random.uniform() > keep) continue;
    if (i < scene.patches.size()) {
      scene.patch_place[patches] = scene.patch_place[i];
      scene.patches[patches++] = scene.patches[i];
    }
    scene.points[to] = scene.points[i];
    scene.thing[to] = scene.thing[i];
    scene.part[to++] = scene.part[i];
  }
  scene.patches.resize(patches);
  scene.patch_place.resize(patches);
  scene.points.resize(to);
  scene.thing.resize(to);
  scene.part.resize(to);
}

struct Move {
  double yaw_rad = 0;
  Pose moved_from_world;
};

Move random_move(const TrainRates& rates, const Eigen::Vector3d& center, Random& random) {
  const double limit = rates.rotation_deg * std::numbers::pi / 180;
  const double yaw_rad = random.uniform(-limit, limit);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()));
  const Eigen::Vector3d shift(random.uniform(-rates.shift_m, rates.shift_m),
                              random.uniform(-rates.shift_m, rates.shift_m),
                              random.uniform(-rates.lift_m, rates.lift_m));
  return {yaw_rad, {center + shift - turn * center, turn}};
}

void move_points(PreparedScene& scene, const Move& move, double jitter_m, Random& random) {
  const auto reach = static_cast<float>(jitter_m * std::sqrt(3.0));  // uniform with that standard deviation
  for (ScenePoint& p : scene.points) {
    Eigen::Vector3f noise;
    for (int a = 0; a < 3; ++a) noise[a] = static_cast<float>(random.uniform(-1, 1)) * reach;
    move_point(p, move.moved_from_world, move.yaw_rad);
    p.position += noise;
  }
  // A turn about z leaves heights alone, so what the offset has of z is the lift.
  scene.plane_z += static_cast<float>(move.moved_from_world.position.z());
}

}  // namespace

SceneInput prepare_input(const PolicyInput& input, const Box& bounds, const NetworkShape& shape,
                         const Vocabulary& vocabulary) {
  if (input.history.empty()) throw std::invalid_argument("the policy input has no robot state");
  SceneInput out;
  out.scene = std::make_shared<const PreparedScene>(prepare_scene(input.observation, bounds, shape));
  out.words = vocabulary.encode(input.instruction, shape.words);
  const int known = static_cast<int>(input.history.size());
  for (int i = 0; i < history_length; ++i)
    out.history[static_cast<std::size_t>(i)] =
        input.history[static_cast<std::size_t>(std::max(0, known - history_length + i))];
  out.keyframe_index = std::max(0, input.keyframe_index);
  return out;
}

PolicyInput input_of_keyframe(const Demo& demo, int k) {
  if (k < 0 || k >= static_cast<int>(demo.keyframes.size()))
    throw std::invalid_argument("demonstration " + demo.info.id + " has no keyframe " + std::to_string(k));
  PolicyInput input;
  input.observation = k == 0 ? demo.start : demo.keyframes[static_cast<std::size_t>(k - 1)].observation;
  input.instruction = demo.info.instruction;
  input.keyframe_index = k;
  if (demo.frames.empty())
    throw std::invalid_argument("demonstration " + demo.info.id + " has no frames, so no robot state");
  input.history.push_back(state_at(demo, 0));
  for (int j = 0; j < k; ++j)
    input.history.push_back(state_at(demo, demo.keyframes[static_cast<std::size_t>(j)].frame));
  return input;
}

std::vector<Sample> samples_of(const Demo& demo, const Box& bounds, const NetworkShape& shape,
                               const Vocabulary& vocabulary, bool keep_observation) {
  std::vector<Sample> samples;
  try {
    std::vector<std::vector<Word>> phrasings{vocabulary.encode(demo.info.instruction, shape.words)};
    for (const std::string& text : demo.instructions)
      if (text != demo.info.instruction) phrasings.push_back(vocabulary.encode(text, shape.words));
    for (int k = 0; k < static_cast<int>(demo.keyframes.size()); ++k) {
      PolicyInput input = input_of_keyframe(demo, k);
      samples.push_back({demo.info.id, prepare_input(input, bounds, shape, vocabulary), phrasings,
                         demo.keyframes[static_cast<std::size_t>(k)].action, nullptr});
      if (keep_observation)
        samples.back().observation = std::make_shared<const Observation>(std::move(input.observation));
    }
  } catch (const std::exception& e) {
    throw std::invalid_argument("demonstration " + demo.info.id + ": " + e.what());
  }
  if (samples.empty()) throw std::invalid_argument("demonstration " + demo.info.id + " has no keyframes");
  return samples;
}

Sample augment(const Sample& sample, const TrainRates& rates, const Eigen::Vector3d& center, Random& random,
               const Augmentation& kinds) {
  if (!kinds.move && !kinds.recolor && !kinds.repaint && !kinds.shuffle) return sample;
  Sample out = sample;
  auto scene = std::make_shared<PreparedScene>(*sample.input.scene);
  const Move move = kinds.move ? random_move(rates, center, random) : Move{};
  // First phrasing half of the time: it is the one that evaluation uses.
  if (random.uniform() < 0.5)
    out.input.words =
        sample.phrasings[static_cast<std::size_t>(random.below(static_cast<int>(sample.phrasings.size())))];
  // A frozen trunk's pictures cannot follow a change of colours.
  if (!scene->pictures) change_colors(*scene, out.input.words, kinds, random);
  if (kinds.shuffle && random.uniform() < rates.shuffle)
    move_things(*scene, out.target, sample.input.history.back().world_from_tool, rates.shuffle_m, random);
  drop_points(*scene, random);
  move_points(*scene, move, rates.jitter_m, random);
  for (RobotState& r : out.input.history) r.world_from_tool = move.moved_from_world * r.world_from_tool;
  blur_past(out.input.history, random);
  out.target.world_from_tool = move.moved_from_world * out.target.world_from_tool;
  out.input.scene = std::move(scene);
  return out;
}

Sample with_cropped_pictures(const Sample& sample, const Box& bounds, const NetworkShape& shape,
                             Random& random) {
  if (!sample.observation || sample.observation->views.empty())
    throw std::invalid_argument("demonstration " + sample.demo + ": no pictures were kept to be cropped");
  const CameraModel& camera = sample.observation->views.front().camera;
  const ResampledObservation seen =
      resample(*sample.observation, random_crop(camera.width, camera.height, random));
  Sample out = sample;
  try {
    out.input.scene =
        std::make_shared<const PreparedScene>(prepare_scene(seen.observation, bounds, shape, &seen.world));
  } catch (const std::invalid_argument&) {
    return sample;
  }
  return out;
}

}  // namespace flowscope
