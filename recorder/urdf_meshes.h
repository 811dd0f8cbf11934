// The meshes of a URDF: found, checked, and those that the simulator does not read turned into ones that it
// does.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "recorder/urdf.h"

namespace flowscope {

class UrdfMeshes {
 public:
  UrdfMeshes(const SceneSource& urdf, const std::function<void(const std::string&)>& note)
      : urdf_(urdf), note_(note) {}

  /// Makes every mesh of `robot` name a file that the simulator finds and reads. `own` is its <mujoco>
  /// element, which says how MuJoCo itself looks for them; or null. Throws SceneError.
  void open(XmlElement& robot, const XmlElement* own);
  /// All but the text.
  OpenedUrdf take();

 private:
  using Version = std::pair<std::filesystem::path, std::string>;  ///< a file in one scale
  struct Use {
    XmlElement* mesh;
    XmlElement* shape;  ///< visual or collision, which has the mesh
    std::filesystem::path file;
    Version version() const { return {file, mesh->get("scale")}; }
  };
  /// A mesh in the form that the simulator reads.
  struct Converted {
    std::string file;                 ///< its OBJ among the opened files
    std::optional<std::string> rgba;  ///< its one colour, where it has one of its own
  };

  void find_uses(XmlElement& element, XmlElement* shape);
  void check_all_there() const;
  void place(Use& use);
  std::filesystem::path own_path(const XmlElement& mesh) const;
  bool is_converted(const Use& use);
  const Converted& converted(const Use& use);
  std::string free_name(const Version& version, const std::string& ending);

  const SceneSource& urdf_;
  const std::function<void(const std::string&)>& note_;
  bool is_own_ = false, strips_ = false;
  std::filesystem::path own_folder_;
  std::vector<Use> uses_;
  std::map<std::string, Version> names_;   ///< MuJoCo's names of meshes, and whose they are
  std::map<Version, std::string> copies_;  ///< files under another name
  std::map<Version, Converted> converted_;
  OpenedUrdf opened_;
};

}  // namespace flowscope
