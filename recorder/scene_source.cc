#include "recorder/scene_source.h"

#include <fstream>
#include <iterator>
#include <map>

namespace flowscope {
namespace {

namespace fs = std::filesystem;

std::string second_element(const std::string& first, const std::string& second) {
  const std::string text =
      "<" + second + "> stands after <" + first + ">, but of a file only the first element is read";
  const bool is_urdf = (first == "mujoco" && second == "robot") || (first == "robot" && second == "mujoco");
  return is_urdf ? text + "; in a URDF, <mujoco> belongs inside <robot>" : text;
}

class SourceReader {
 public:
  explicit SourceReader(const SharedText& shared) : shared_(shared) {}

  SceneSource read(const fs::path& scene) {
    source_.files.push_back(scene);
    folder_ = source_.folder();
    included_[scene.lexically_normal().string()] = {0, 0};
    XmlElement root = element(read_text(scene), 0, "");
    take_in(root);
    source_.root = std::move(root);
    return std::move(source_);
  }

 private:
  [[noreturn]] void fail(const XmlPlace& at, const std::string& why) const {
    throw SceneError(source_.place(at) + ": " + why);
  }

  XmlElement element(const std::string& text, int file, const std::string& remark) {
    try {
      std::vector<XmlElement> elements = parse_xml_elements(text);
      for (auto& one : elements) set_file(one, file);
      if (elements.size() > 1 && source_.unread.empty()) {
        source_.unread = source_.place(elements[1].place) + ": " +
                         second_element(elements[0].tag, elements[1].tag) + remark;
      }
      return std::move(elements[0]);
    } catch (const XmlError& error) {
      fail({file, error.line}, "is no valid XML: " + error.reason + remark);
    }
  }
  static void set_file(XmlElement& element, int file) {
    element.place.file = file;
    for (auto& child : element.children) set_file(child, file);
  }

  /// Puts the children of what is included in the place of each include.
  void take_in(XmlElement& parent) {
    std::vector<XmlElement> children;
    for (auto& child : parent.children) {
      if (child.tag == "include") {
        XmlElement root = included(child);
        take_in(root);
        for (auto& grandchild : root.children) children.push_back(std::move(grandchild));
      } else {
        take_in(child);
        children.push_back(std::move(child));
      }
    }
    parent.children = std::move(children);
  }

  XmlElement included(const XmlElement& include) {
    const std::string name = from_xml_value(include.get("file"));
    if (name.empty()) fail(include.place, "<include> says no file");
    fs::path path = (folder_ / name).lexically_normal();
    const auto [before, is_new] = included_.emplace(path.string(), include.place);
    if (!is_new) {
      fail(include.place, path.string() + " is included a second time (a scene takes in each file once; " +
                              (before->second.line == 0 ? "it is the scene itself)"
                                                        : "first at " + source_.place(before->second) + ")"));
    }
    std::string text;
    std::error_code none;
    if (fs::is_regular_file(path, none)) {
      text = read_text(path);
    } else if (auto shared = shared_(fs::path(name).filename().string())) {
      std::tie(path, text) = *std::move(shared);
    } else {
      fail(include.place, "the file to include, " + path.string() + ", is not there" +
                              (include.place.file == 0 ? "" : " (from the folder of the scene itself)"));
    }
    source_.files.push_back(path);
    XmlElement root = element(text, static_cast<int>(source_.files.size()) - 1,
                              " (included at " + source_.place(include.place) + ")");
    if (root.children.empty()) fail(include.place, "the file to include, " + path.string() + ", is empty");
    return root;
  }

  const SharedText& shared_;
  SceneSource source_;
  fs::path folder_;
  std::map<std::string, XmlPlace> included_;  ///< where, by path
};

/// MuJoCo calls a mesh or picture without a name after its file.
bool is_called(const XmlElement& element, const std::string& name) {
  if (from_xml_value(element.get("name")) == name) return true;
  for (const char* file : {"file", "filename"}) {
    const std::string value = from_xml_value(element.get(file));
    if (!value.empty() && fs::path(value).stem() == name) return true;
  }
  return false;
}

void find_called(const XmlElement& element, const std::string& name, const std::string& words,
                 const XmlElement*& found, bool& of_kind) {
  if (of_kind) return;
  if (element.place.line > 0 && is_called(element, name)) {
    of_kind = words.find(element.tag) != std::string::npos;
    if (!found || of_kind) found = &element;
  }
  for (const auto& child : element.children) find_called(child, name, words, found, of_kind);
}

}  // namespace

fs::path SceneSource::folder() const {
  return files.at(0).has_parent_path() ? files[0].parent_path() : fs::path(".");
}

std::string SceneSource::place(const XmlPlace& at) const {
  if (at.line <= 0) return files.at(0).string();
  return files.at(static_cast<std::size_t>(at.file)).string() + ":" + std::to_string(at.line);
}

const XmlElement* SceneSource::find(const std::string& name, const std::string& words) const {
  const XmlElement* found = nullptr;
  bool of_kind = false;
  if (!name.empty()) find_called(root, name, words, found, of_kind);
  return found;
}

SceneSource read_source(const fs::path& scene, const SharedText& shared) {
  return SourceReader(shared).read(scene);
}

std::string read_text(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::error_code none;
  if (!stream || fs::is_directory(file, none))
    throw std::runtime_error(file.string() + ": can not be read" + (stream ? ": it is a folder" : ""));
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace flowscope
