#include "app/trace_shelf.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <system_error>
#include <type_traits>

#include "recorder/bytes.h"

namespace flowscope {

namespace {

/// Both directions go through one list of fields (`pass` below), so that they cannot differ.
class Writer {
 public:
  static constexpr bool reads = false;
  Bytes bytes;

  template <Plain T>
  void number(T& value) {
    put(bytes, value);
  }
  template <Plain T>
  void numbers(T* first, std::size_t count) {
    put_all(bytes, std::span<const T>(first, count));
  }
};

class Reader {
 public:
  static constexpr bool reads = true;
  explicit Reader(const Bytes& bytes) : rest_(bytes) {}

  template <Plain T>
  void number(T& value) {
    value = rest_.get<T>();
  }
  template <Plain T>
  void numbers(T* first, std::size_t count) {
    rest_.get_all(std::span<T>(first, count));
  }

 private:
  ByteReader rest_;
};

template <class A, Plain T>
void pass(A& a, T& value) {
  a.number(value);
}

template <class A, class Container>
void pass_size(A& a, Container& container) {
  std::uint64_t size = container.size();
  a.number(size);
  if constexpr (A::reads) container.resize(size);
}

template <class A>
void pass(A& a, std::string& text) {
  pass_size(a, text);
  a.numbers(text.data(), text.size());
}

template <class A, class T, std::size_t n>
void pass(A& a, std::array<T, n>& values) {
  a.numbers(values.data(), n);
}

template <class A, class T, int n>
void pass(A& a, Eigen::Matrix<T, n, 1>& vector) {
  a.numbers(vector.data(), static_cast<std::size_t>(n));
}

template <class A, class T>
void pass(A& a, std::vector<T>& values) {
  pass_size(a, values);
  if constexpr (Plain<T>) {
    a.numbers(values.data(), values.size());
  } else {
    for (T& value : values) pass(a, value);
  }
}

template <class A, class T>
void pass(A& a, std::optional<T>& value) {
  bool there = value.has_value();
  a.number(there);
  if (!there) return;
  if constexpr (A::reads) value.emplace();
  pass(a, *value);
}

template <class A, class... Fields>
void pass_all(A& a, Fields&... fields) {
  (pass(a, fields), ...);
}

template <class A>
void pass(A& a, Pose& p) {
  pass(a, p.position);
  a.numbers(p.rotation.coeffs().data(), 4);
}

template <class A>
void pass(A& a, GripperAction& g) {
  pass_all(a, g.world_from_tool, g.openness);
}

template <class A>
void pass(A& a, RobotState& r) {
  pass_all(a, r.world_from_tool, r.openness, r.q);
}

template <class A>
void pass(A& a, View& v) {
  CameraModel& c = v.camera;
  pass_all(a, c.name, c.width, c.height, c.fx, c.fy, c.cx, c.cy, c.near_m, c.far_m, c.world_from_camera);
  pass_all(a, v.rgb.width, v.rgb.height, v.rgb.data, v.depth.width, v.depth.height, v.depth.data);
}

template <class A>
void pass(A& a, PolicyInput& p) {
  pass_all(a, p.observation.views, p.instruction, p.history, p.keyframe_index, p.robot);
}

template <class A>
void pass(A& a, SceneState& s) {
  pass_all(a, s.scene, s.time_s, s.qpos, s.qvel, s.act, s.ctrl, s.qacc_warmstart, s.mocap_pos, s.mocap_quat,
           s.eq_active, s.eq_data, s.mat_rgba);
}

template <class A>
void pass(A& a, FlowStep& s) {
  pass_all(a, s.k, s.t, s.x, s.velocity, s.pose, s.region.center, s.region.radius_m, s.region.points,
           s.region.inside, s.open_probability, s.ms, s.weights, s.weight_points);
}

template <class A>
void pass(A& a, PoseError& e) {
  pass_all(a, e.position_m, e.rotation_deg, e.open_correct);
}

template <class A>
void pass(A& a, FlowTrace::Parent& p) {
  pass_all(a, p.trace, p.step);
}

template <class A>
void pass(A& a, FlowTrace& t) {
  pass_all(a, t.id, t.created, t.policy_file, t.weights_sha256, t.backbone, t.objective, t.integrator,
           t.generation, t.radius.kind, t.radius.r_0, t.radius.r_min, t.flow_steps, t.seed);
  pass_all(a, t.scene.task, t.scene.variation, t.scene.seed, t.scene.demo, t.scene.keyframe,
           t.scene.state_sha256);
  pass_all(a, t.instruction, t.steps, t.result, t.expert, t.error, t.parent);
}

[[noreturn]] void fail(const std::string& what) {
  throw std::system_error(errno, std::generic_category(), what);
}

}  // namespace

TraceShelf::TraceShelf(const std::filesystem::path& folder) {
  std::string name = (folder / ".flowscope-tmp-traces-XXXXXX").string();
  file_ = ::mkostemp(name.data(), O_CLOEXEC);
  if (file_ < 0) fail("cannot write in " + folder.string());
  ::unlink(name.c_str());
}

TraceShelf::~TraceShelf() { ::close(file_); }

TraceShelf::Place TraceShelf::put(const StoredTrace& stored) {
  Writer writer;
  auto copy = stored;  // `pass` goes both ways, so it wants what it could change
  pass_all(writer, copy.trace, copy.state, copy.episode);
  std::optional<PolicyInput> input;
  if (stored.input) input = *stored.input;
  pass(writer, input);
  const Bytes packed = deflate_bytes(writer.bytes);
  const Place place{end_, packed.size(), writer.bytes.size()};
  for (std::size_t done = 0; done < packed.size();) {
    const ssize_t count =
        ::pwrite(file_, packed.data() + done, packed.size() - done, static_cast<off_t>(end_ + done));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) fail("cannot put an older trace away");
    done += static_cast<std::size_t>(count);
  }
  end_ += packed.size();
  return place;
}

StoredTrace TraceShelf::take(const Place& place) const {
  Bytes packed(place.packed);
  for (std::size_t done = 0; done < packed.size();) {
    const ssize_t count =
        ::pread(file_, packed.data() + done, packed.size() - done, static_cast<off_t>(place.at + done));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) throw std::runtime_error("an older trace cannot be read any more");
    done += static_cast<std::size_t>(count);
  }
  const Bytes raw = inflate_bytes(packed, place.raw);
  Reader reader(raw);
  StoredTrace stored;
  pass_all(reader, stored.trace, stored.state, stored.episode);
  std::optional<PolicyInput> input;
  pass(reader, input);
  if (input) stored.input = std::make_shared<const PolicyInput>(std::move(*input));
  return stored;
}

void TraceShelf::drop(const Place& place) {
  // A file system that cannot do that keeps the room until the program ends.
  static_cast<void>(::fallocate(file_, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE,
                                static_cast<off_t>(place.at), static_cast<off_t>(place.packed)));
}

}  // namespace flowscope
