#include "recorder/scene_trouble.h"

#include <cstdlib>

namespace flowscope {
namespace {

namespace fs = std::filesystem;

/// MuJoCo's message in parts.
struct Said {
  std::string what;     ///< its first line, without its kind
  std::string element;  ///< tag; may be empty
  std::string object;   ///< name; may be empty
  int line = 0;         ///< 0: it knows none
};

/// What stands between two words; empty when the first is not there.
std::string between(const std::string& text, const std::string& begin, const std::string& end) {
  const auto from = text.find(begin);
  if (from == std::string::npos) return "";
  const auto first = from + begin.size();
  return text.substr(first, text.find(end, first) - first);
}

/// "Element 'geom', line 3", "Object name = b, id = 1, line = 3, column = -1", "Line number=3".
Said parts_of(const std::string& text) {
  Said said;
  said.what = text.substr(0, text.find('\n'));
  for (const std::string kind : {"XML Error: ", "Error: ", "Schema violation: "}) {
    if (said.what.starts_with(kind)) said.what.erase(0, kind.size());
  }
  said.element = between(text, "\nElement '", "'");
  said.object = between(text, "\nObject name = ", ",");
  for (const std::string& before :
       {"\nElement '" + said.element + "', line ", std::string(", line = "), std::string("Line number=")}) {
    if (said.line <= 0) said.line = std::atoi(between(text, before, "\n").c_str());
  }
  if (const std::string kind = between(text, "Error=XML_ERROR_", " "); !kind.empty())
    said.what = "is no valid XML (" + kind + ")";
  return said;
}

/// The key frame of this number; MuJoCo knows no lines of those.
const XmlElement* find_key(const XmlElement& root, int number) {
  for (const auto& child : root.children) {
    if (child.tag != "keyframe") continue;
    for (const auto& key : child.children) {
      if (key.tag == "key" && number-- == 0) return &key;
    }
  }
  return nullptr;
}

class MissingFiles {
 public:
  MissingFiles(const SceneSource& source, const std::function<bool(const std::string&)>& is_shared)
      : source_(source), is_shared_(is_shared) {
    for (const auto& child : source.root.children) {
      if (child.tag != "compiler") continue;
      if (const auto value = child.get("meshdir"); !value.empty()) meshes_ = from_xml_value(value);
      if (const auto value = child.get("texturedir"); !value.empty()) pictures_ = from_xml_value(value);
      if (const auto value = child.get("strippath"); !value.empty()) strip_ = value == "true";
    }
    for (const auto& child : source.root.children) {
      if (child.tag == "asset") look_at(child);
    }
  }
  const std::string& text() const { return text_; }

 private:
  void look_at(const XmlElement& asset) {
    for (const auto& element : asset.children) {
      for (const auto& [key, value] : element.attributes) {
        if (!key.starts_with("file") || value.empty()) continue;
        const bool is_mesh = element.tag == "mesh" || element.tag == "hfield" || element.tag == "skin";
        if (!is_mesh && element.tag != "texture") continue;
        check(element, from_xml_value(value), is_mesh ? meshes_ : pictures_);
      }
    }
  }
  void check(const XmlElement& element, const std::string& name, const fs::path& folder) {
    const fs::path bare = fs::path(name).filename();
    if (is_shared_(bare.string())) return;
    const fs::path path = (source_.folder() / folder / (strip_ ? bare : fs::path(name))).lexically_normal();
    std::error_code none;
    if (fs::exists(path, none)) return;
    text_ += (text_.empty() ? "" : "\n") + source_.place(element.place) + ": the " + element.tag +
             "'s file " + path.string() + " is not there";
  }

  const SceneSource& source_;
  const std::function<bool(const std::string&)>& is_shared_;
  fs::path meshes_, pictures_;
  bool strip_ = false;
  std::string text_;
};

}  // namespace

SceneError scene_trouble(const std::string& text, const SceneSource& source,
                         const std::vector<XmlPlace>& lines) {
  const Said said = parts_of(text);
  XmlPlace at;
  if (said.line > 0 && static_cast<std::size_t>(said.line) <= lines.size())
    at = lines[static_cast<std::size_t>(said.line) - 1];
  if (at.line == 0) {
    const bool is_key = said.what.starts_with("key ");
    const XmlElement* element = is_key ? find_key(source.root, std::atoi(said.what.c_str() + 4))
                                       : source.find(said.object, said.what);
    if (element) at = element->place;
  }
  std::string what = said.what;
  if (what.starts_with("Unrecognized XML model type")) {
    at = source.root.place;
    what = "its first element is <" + source.root.tag + ">; a scene's is <mujoco> (MJCF) or <robot> (URDF)";
  }
  if (what.starts_with("Unknown mesh file type"))
    what += "; MuJoCo reads STL and OBJ, and flowscope scene import makes an object of others";
  if (!said.element.empty()) what += " in <" + said.element + ">";
  if (!said.object.empty() && what.find("'" + said.object + "'") == std::string::npos)
    what += " (" + said.object + ")";
  return SceneError(source.place(at) + ": " + what);
}

std::string missing_files(const SceneSource& source,
                          const std::function<bool(const std::string&)>& is_shared) {
  return MissingFiles(source, is_shared).text();
}

}  // namespace flowscope
