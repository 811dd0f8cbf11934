// Where the bulk of older traces lies: a file without a name, which is gone with the program.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "policy/policy.h"
#include "render/scene_state.h"

namespace flowscope {

/// A trace together with the scene it was made in, which drawing and branching need.
struct StoredTrace {
  FlowTrace trace;
  SceneState state;
  std::shared_ptr<const PolicyInput> input;  ///< shared by the samples of one call; may be null
  std::uint64_t episode = 0;
};

/// What is taken out is what was put in, bit for bit. One thread at a time.
class TraceShelf {
 public:
  struct Place {
    std::uint64_t at = 0;
    std::size_t packed = 0, raw = 0;  ///< bytes
  };

  /// The file lies in `folder`, under no name. Throws std::system_error.
  explicit TraceShelf(const std::filesystem::path& folder);
  ~TraceShelf();
  TraceShelf(const TraceShelf&) = delete;
  TraceShelf& operator=(const TraceShelf&) = delete;

  /// Throws std::system_error when there is no room.
  Place put(const StoredTrace& stored);
  /// Throws std::runtime_error when it cannot be read.
  StoredTrace take(const Place& place) const;
  /// Gives the room back to the disk.
  void drop(const Place& place);

 private:
  int file_ = -1;
  std::uint64_t end_ = 0;
};

}  // namespace flowscope
