#include "recorder/demo_states.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "recorder/sha256.h"

namespace flowscope {
namespace {

StateLayout layout_of(const SceneState& state) {
  return {state.scene,
          state.qpos.size(),
          state.qvel.size(),
          state.act.size(),
          state.ctrl.size(),
          state.qacc_warmstart.size(),
          state.mocap_pos.size(),
          state.mocap_quat.size(),
          state.eq_active.size(),
          state.eq_data.size(),
          state.mat_rgba.size()};
}

/// Calls `visit` with every vector of a state, in the file's order.
template <typename State, typename Visitor>
void for_each_part(State& state, Visitor&& visit) {
  visit(state.qpos);
  visit(state.qvel);
  visit(state.act);
  visit(state.ctrl);
  visit(state.qacc_warmstart);
  visit(state.mocap_pos);
  visit(state.mocap_quat);
  visit(state.eq_data);
  visit(state.mat_rgba);
  visit(state.eq_active);
}

Bytes to_bytes(const SceneState& state, std::size_t frame) {
  Bytes bytes;
  put(bytes, state.time_s);
  bool finite = std::isfinite(state.time_s);
  for_each_part(state, [&](const auto& part) {
    for (const auto value : part) {
      finite = finite && std::isfinite(static_cast<double>(value));
      put(bytes, value);
    }
  });
  if (!finite) {
    throw std::invalid_argument("the state of frame " + std::to_string(frame) +
                                " holds a number that is not finite");
  }
  return bytes;
}

SceneState sized_state(const StateLayout& layout) {
  SceneState state;
  state.scene = layout.scene;
  state.qpos.resize(layout.qpos);
  state.qvel.resize(layout.qvel);
  state.act.resize(layout.act);
  state.ctrl.resize(layout.ctrl);
  state.qacc_warmstart.resize(layout.qacc_warmstart);
  state.mocap_pos.resize(layout.mocap_pos);
  state.mocap_quat.resize(layout.mocap_quat);
  state.eq_active.resize(layout.eq_active);
  state.eq_data.resize(layout.eq_data);
  state.mat_rgba.resize(layout.mat_rgba);
  return state;
}

/// What stays the same from frame to frame becomes zeros, which cost almost nothing.
void xor_into(std::span<std::uint8_t> bytes, std::span<const std::uint8_t> other) {
  std::transform(bytes.begin(), bytes.end(), other.begin(), bytes.begin(), std::bit_xor<>());
}

}  // namespace

StateLayout describe_states(const std::vector<Frame>& frames) {
  if (frames.empty()) return {};
  const StateLayout layout = layout_of(frames.front().state);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (layout_of(frames[i].state) != layout) {
      throw std::invalid_argument("the state of frame " + std::to_string(i) +
                                  " is of another scene or size than the first");
    }
  }
  return layout;
}

std::uint64_t pack_states(const std::vector<Frame>& frames, StateLayout& layout, Bytes& blocks) {
  layout = describe_states(frames);
  Bytes all, previous(layout.bytes());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Bytes bytes = to_bytes(frames[i].state, i);
    xor_into(previous, bytes);
    all.insert(all.end(), previous.begin(), previous.end());
    previous = bytes;
  }
  const Bytes packed = deflate_bytes(all);
  blocks.insert(blocks.end(), packed.begin(), packed.end());
  return packed.size();
}

void unpack_states(std::span<const std::uint8_t> packed, const StateLayout& layout,
                   std::vector<Frame>& frames) {
  const std::size_t size = layout.bytes();
  Bytes all = inflate_bytes(packed, size * frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::span<std::uint8_t> bytes(all.data() + i * size, size);
    if (i > 0) xor_into(bytes, {all.data() + (i - 1) * size, size});
    ByteReader reader(bytes);
    frames[i].state = sized_state(layout);
    frames[i].state.time_s = reader.get<double>();
    for_each_part(frames[i].state, [&](auto& part) {
      reader.get_all<typename std::decay_t<decltype(part)>::value_type>(part);
    });
  }
}

std::string states_sha256(const std::vector<Frame>& frames) {
  Bytes all;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Bytes bytes = to_bytes(frames[i].state, i);
    all.insert(all.end(), bytes.begin(), bytes.end());
  }
  return sha256_hex(all);
}

}  // namespace flowscope
