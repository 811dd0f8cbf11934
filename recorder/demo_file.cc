#include "recorder/demo_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>

#include "recorder/demo_pixels.h"
#include "recorder/demo_states.h"
#include "recorder/sha256.h"

namespace flowscope {
namespace {

constexpr char magic[] = {'F', 'L', 'O', 'W', 'D', 'E', 'M', 'O'};
constexpr std::uint32_t version = 1;
constexpr std::uint64_t prelude_bytes = sizeof(magic) + 2 * sizeof(std::uint32_t);
constexpr std::uint64_t frame_size = 24 * sizeof(double);
constexpr std::uint64_t checksum_bytes = 64;  // as hex text: `tail -c 64` shows it
constexpr std::uint64_t max_header_bytes = 16u << 20, max_file_bytes = 2ull << 30;

[[noreturn]] void throw_bad(const std::filesystem::path& file, const std::string& problem) {
  throw BadDemo(file.string() + ": " + problem);
}

/// Length of the JSON header, after the first bytes have been found to be ours.
std::uint32_t read_prelude(std::span<const std::uint8_t> bytes, const std::filesystem::path& file) {
  ByteReader reader(bytes);
  if (bytes.size() < prelude_bytes) throw_bad(file, "too short to be a demonstration");
  if (std::memcmp(reader.take(sizeof(magic)).data(), magic, sizeof(magic)) != 0) {
    throw_bad(file, "does not begin with FLOWDEMO: not a demonstration");
  }
  const auto found = reader.get<std::uint32_t>();
  if (found != version) {
    throw_bad(file, "has format version " + std::to_string(found) + "; this program reads " +
                        std::to_string(version));
  }
  const auto header_bytes = reader.get<std::uint32_t>();
  if (header_bytes > max_header_bytes) throw_bad(file, "header length is out of range");
  return header_bytes;
}

DemoHeader read_header(std::span<const std::uint8_t> text, const std::filesystem::path& file) {
  try {
    return parse_demo_header(std::string(text.begin(), text.end()));
  } catch (const std::exception& error) {
    throw_bad(file, error.what());
  }
}

void put_pose(Bytes& out, const Pose& pose) {
  const Eigen::Vector4d wxyz = pose.wxyz();
  put_all<double>(out, {pose.position.data(), 3});
  put_all<double>(out, {wxyz.data(), 4});
}

Pose get_pose(ByteReader& reader) {
  std::array<double, 7> v;
  reader.get_all<double>(v);
  return {{v[0], v[1], v[2]}, Eigen::Quaterniond(v[3], v[4], v[5], v[6])};
}

void put_frame(Bytes& out, const Frame& frame) {
  put(out, frame.time_s);
  put_all<double>(out, frame.q);
  put_all<double>(out, frame.dq);
  put(out, frame.openness);
  put(out, frame.gripper_open ? 1.0 : 0.0);
  put_pose(out, frame.world_from_tool);
}

Frame get_frame(ByteReader& reader) {
  Frame frame;
  frame.time_s = reader.get<double>();
  reader.get_all<double>(frame.q);
  reader.get_all<double>(frame.dq);
  frame.openness = reader.get<double>();
  frame.gripper_open = reader.get<double>() != 0;
  frame.world_from_tool = get_pose(reader);
  return frame;
}

DemoHeader header_of(const Demo& demo) {
  if (demo.info.variation < 0) throw std::invalid_argument("the variation is negative");
  DemoHeader header;
  header.info = demo.info;
  header.info.frames = static_cast<int>(demo.frames.size());
  header.simulator = demo.simulator;
  header.instructions = demo.instructions;
  if (header.instructions.empty()) header.instructions.push_back(demo.info.instruction);
  header.bounds = demo.bounds;
  for (const Keyframe& keyframe : demo.keyframes) {
    if (keyframe.frame < 0) throw std::invalid_argument("a keyframe's index is negative");
    header.keyframes.push_back(keyframe.frame);
  }
  return header;
}

/// The numbers that no block checks by itself.
void require_finite(const Demo& demo) {
  const auto require = [](bool finite, const std::string& place) {
    if (!finite) throw std::invalid_argument(place + " is not a finite number");
  };
  const auto finite_pose = [](const Pose& pose) {
    return pose.position.allFinite() && pose.rotation.coeffs().allFinite();
  };
  require(demo.bounds.min.allFinite() && demo.bounds.max.allFinite(), "bounds");
  for (std::size_t i = 0; i < demo.frames.size(); ++i) {
    const Frame& frame = demo.frames[i];
    const auto finite = [](double value) { return std::isfinite(value); };
    require(std::all_of(frame.q.begin(), frame.q.end(), finite) &&
                std::all_of(frame.dq.begin(), frame.dq.end(), finite) && finite(frame.time_s) &&
                finite(frame.openness) && finite_pose(frame.world_from_tool),
            "frame " + std::to_string(i));
  }
  for (std::size_t k = 0; k < demo.keyframes.size(); ++k) {
    const GripperAction& action = demo.keyframes[k].action;
    require(finite_pose(action.world_from_tool) && std::isfinite(action.openness),
            "keyframe " + std::to_string(k));
  }
}

Demo decode_blocks(const DemoHeader& header, ByteReader& reader, DemoParts parts) {
  Demo demo;
  demo.info = header.info;
  demo.simulator = header.simulator;
  demo.instructions = header.instructions;
  demo.bounds = header.bounds;
  for (int i = 0; i < header.info.frames; ++i) demo.frames.push_back(get_frame(reader));
  for (const int frame : header.keyframes) {
    Keyframe& keyframe = demo.keyframes.emplace_back();
    keyframe.frame = frame;
    keyframe.action.world_from_tool = get_pose(reader);
    keyframe.action.openness = reader.get<double>();
  }
  const auto packed_states = reader.take(header.states_bytes);
  if (parts == DemoParts::all) unpack_states(packed_states, header.state, demo.frames);
  demo.start = unpack_observation(reader, header.observations.front());
  for (std::size_t k = 0; k < demo.keyframes.size(); ++k) {
    demo.keyframes[k].observation = unpack_observation(reader, header.observations[k + 1]);
  }
  if (reader.left() != 0) throw std::runtime_error("has bytes that no block explains");
  return demo;
}

}  // namespace

DemoHeader describe_demo(const Demo& demo) {
  require_finite(demo);
  DemoHeader header = header_of(demo);
  header.state = describe_states(demo.frames);
  header.observations.push_back(describe_observation(demo.start));
  for (const Keyframe& keyframe : demo.keyframes) {
    header.observations.push_back(describe_observation(keyframe.observation));
  }
  return header;
}

Bytes encode_demo(const Demo& demo) {
  require_finite(demo);
  DemoHeader header = header_of(demo);
  Bytes blocks;
  for (const Frame& frame : demo.frames) put_frame(blocks, frame);
  for (const Keyframe& keyframe : demo.keyframes) {
    put_pose(blocks, keyframe.action.world_from_tool);
    put(blocks, keyframe.action.openness);
  }
  header.states_bytes = pack_states(demo.frames, header.state, blocks);
  header.observations.push_back(pack_observation(demo.start, blocks));
  for (const Keyframe& keyframe : demo.keyframes) {
    header.observations.push_back(pack_observation(keyframe.observation, blocks));
  }
  const std::string text = to_json_text(header);
  Bytes file(std::begin(magic), std::end(magic));
  put(file, version);
  put(file, static_cast<std::uint32_t>(text.size()));
  file.insert(file.end(), text.begin(), text.end());
  file.insert(file.end(), blocks.begin(), blocks.end());
  const std::string checksum = sha256_hex(file);
  file.insert(file.end(), checksum.begin(), checksum.end());
  return file;
}

Demo decode_demo(std::span<const std::uint8_t> bytes, const std::filesystem::path& file, DemoParts parts) {
  const std::uint32_t header_bytes = read_prelude(bytes, file);
  if (bytes.size() < prelude_bytes + header_bytes + checksum_bytes) {
    throw_bad(file, "is cut short at byte " + std::to_string(bytes.size()));
  }
  const auto content = bytes.first(bytes.size() - checksum_bytes);
  const auto trailer = bytes.last(checksum_bytes);
  if (sha256_hex(content) != std::string(trailer.begin(), trailer.end())) {
    throw_bad(file, "checksum does not match: cut short or damaged");
  }
  const DemoHeader header = read_header(content.subspan(prelude_bytes, header_bytes), file);
  try {
    ByteReader reader(content.subspan(prelude_bytes + header_bytes));
    Demo demo = decode_blocks(header, reader, parts);
    demo.info.id = file.stem().string();
    demo.info.bytes = bytes.size();
    return demo;
  } catch (const std::exception& error) {
    throw_bad(file, std::string("block: ") + error.what());
  }
}

DemoInfo read_demo_info(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  Bytes prelude(prelude_bytes);
  stream.read(reinterpret_cast<char*>(prelude.data()), static_cast<std::streamsize>(prelude.size()));
  prelude.resize(static_cast<std::size_t>(stream.gcount()));
  const std::uint32_t header_bytes = read_prelude(prelude, file);
  std::error_code error;
  const std::uint64_t file_bytes = std::filesystem::file_size(file, error);
  if (error || file_bytes < prelude_bytes + header_bytes + checksum_bytes) throw_bad(file, "is cut short");
  Bytes text(header_bytes);
  if (!stream.read(reinterpret_cast<char*>(text.data()), static_cast<std::streamsize>(text.size()))) {
    throw_bad(file, "header cannot be read");
  }
  DemoInfo info = read_header(text, file).info;
  info.id = file.stem().string();
  info.bytes = file_bytes;
  return info;
}

Bytes frame_bytes(const Frame& frame) {
  Bytes bytes;
  put_frame(bytes, frame);
  return bytes;
}

Bytes read_frame_bytes(const std::filesystem::path& file, std::size_t index) {
  std::ifstream stream(file, std::ios::binary);
  Bytes prelude(prelude_bytes);
  if (!stream.read(reinterpret_cast<char*>(prelude.data()), prelude_bytes)) return {};
  Bytes bytes(frame_size);
  try {
    const std::uint64_t at = prelude_bytes + read_prelude(prelude, file) + index * frame_size;
    stream.seekg(static_cast<std::streamoff>(at));
  } catch (const BadDemo&) {
    return {};
  }
  if (!stream.read(reinterpret_cast<char*>(bytes.data()), frame_size)) return {};
  return bytes;
}

Bytes read_demo_bytes(const std::filesystem::path& file) {
  std::error_code error;
  const std::uint64_t size = std::filesystem::file_size(file, error);
  if (error) throw_bad(file, error.message());
  if (size > max_file_bytes) throw_bad(file, "is larger than any demonstration");
  Bytes bytes(size);
  std::ifstream stream(file, std::ios::binary);
  if (!stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size))) {
    throw_bad(file, "cannot be read");
  }
  return bytes;
}

}  // namespace flowscope
