// XML as MuJoCo writes it, as a tree to add to: elements with attributes, nothing between them.
#pragma once

#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

namespace flowscope {

struct XmlElement {
  std::string tag;
  std::vector<std::pair<std::string, std::string>> attributes;  ///< values as in the file, entities and all
  std::vector<XmlElement> children;

  /// Empty when there is none.
  std::string get(const std::string& name) const;
  void set(const std::string& name, std::string value);
  XmlElement& add(XmlElement child) { return children.emplace_back(std::move(child)); }
};

/// The document's element. Comments, declarations and text between elements are passed over. Throws
/// std::runtime_error for what is no XML.
XmlElement parse_xml(const std::string& text);
std::string to_text(const XmlElement& element);

}  // namespace flowscope
