// The text of a scene as its author wrote it: every element with its file and line, all that it includes in
// its place.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "recorder/script.h"
#include "recorder/xml_tree.h"

namespace flowscope {

/// A scene that cannot be used; what() starts with "<file>:<line>: ", or "<file>: " where no line is to
/// blame.
class SceneError : public BadScript {
 public:
  using BadScript::BadScript;
};

struct SceneSource {
  std::vector<std::filesystem::path> files;  ///< the scene's own first; XmlPlace::file counts them from 0
  XmlElement root;
  std::string unread;  ///< "<file>:<line>: …" of the first element that stands after a file's only one

  std::filesystem::path folder() const;  ///< of the scene, where its files are looked for
  /// "<file>:<line>", or the scene's file for what nobody wrote.
  std::string place(const XmlPlace& at) const;
  /// The element with this name, or which brings a mesh or picture of this name; preferred is one of the
  /// kind that `words` mention. Null when there is none.
  const XmlElement* find(const std::string& name, const std::string& words) const;
};

/// A shared file of a bare name (no folders): its path and text.
using SharedText =
    std::function<std::optional<std::pair<std::filesystem::path, std::string>>(const std::string& name)>;

/// Included files are looked for as MuJoCo does: from the folder of the scene itself, wherever the including
/// one lies, then among the shared ones. Throws SceneError for what is no XML or includes what is not there
/// or has been included before.
SceneSource read_source(const std::filesystem::path& scene, const SharedText& shared);

/// The whole file; throws std::runtime_error that names it.
std::string read_text(const std::filesystem::path& file);

}  // namespace flowscope
