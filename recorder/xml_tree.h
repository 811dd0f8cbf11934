// XML as MuJoCo writes it, as a tree to add to: elements with attributes, nothing between them.
#pragma once

#include <initializer_list>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace flowscope {

/// What is no XML.
class XmlError : public std::runtime_error {
 public:
  XmlError(int at_line, const std::string& what)
      : std::runtime_error("line " + std::to_string(at_line) + ": " + what), line(at_line), reason(what) {}
  int line;
  std::string reason;
};

/// Where an element was read; line 0: nowhere, it was added.
struct XmlPlace {
  int file = 0;  ///< whatever its reader counts
  int line = 0;
};

struct XmlElement {
  std::string tag;
  std::vector<std::pair<std::string, std::string>> attributes;  ///< values as in the file, entities and all
  std::vector<XmlElement> children;
  XmlPlace place{};

  /// Empty when there is none.
  std::string get(const std::string& name) const;
  void set(const std::string& name, std::string value);
  XmlElement& add(XmlElement child) { return children.emplace_back(std::move(child)); }
};

/// The document's element. Comments, declarations and text between elements are passed over. Throws XmlError.
XmlElement parse_xml(const std::string& text);
/// Every element at the top, of which XML has one. Throws XmlError.
std::vector<XmlElement> parse_xml_elements(const std::string& text);
std::string to_text(const XmlElement& element);

/// A text and, for each of its lines, where that line's element was read.
struct PlacedText {
  std::string text;
  std::vector<XmlPlace> lines;
};
PlacedText to_placed_text(const XmlElement& element);

/// An attribute's value as the reader of the file means it, without entities, and back.
std::string from_xml_value(const std::string& value);
std::string to_xml_value(const std::string& text);

}  // namespace flowscope
