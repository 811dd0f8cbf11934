#include "recorder/xml_tree.h"

#include <algorithm>
#include <array>

namespace flowscope {
namespace {

constexpr int kMaxDepth = 1000;
constexpr const char* kSpace = " \t\r\n";

class XmlParser {
 public:
  explicit XmlParser(const std::string& text) : text_(text) {}

  XmlElement document() {
    if (!next_tag()) fail("holds no element");
    return element(0);
  }
  std::vector<XmlElement> all() {
    std::vector<XmlElement> result{document()};
    while (next_tag()) result.push_back(element(0));
    return result;
  }

 private:
  [[noreturn]] void fail(const std::string& what) { throw XmlError(line(), what); }
  /// Of where it stands, which never moves back.
  int line() {
    const auto from = text_.begin() + static_cast<std::ptrdiff_t>(counted_);
    line_ += static_cast<int>(std::count(from, text_.begin() + static_cast<std::ptrdiff_t>(at_), '\n'));
    counted_ = at_;
    return line_;
  }
  void skip_behind(const std::string& end) {
    const auto found = text_.find(end, at_);
    if (found == std::string::npos) fail("ends before '" + end + "'");
    at_ = found + end.size();
  }
  /// Stands at the '<' of the next element, or of the end of one; false at the text's end.
  bool next_tag() {
    while ((at_ = text_.find('<', at_)) != std::string::npos) {
      if (text_.compare(at_, 4, "<!--") == 0) {
        skip_behind("-->");
      } else if (text_.compare(at_, 2, "<?") == 0 || text_.compare(at_, 2, "<!") == 0) {
        skip_behind(">");
      } else {
        return true;
      }
    }
    at_ = text_.size();
    return false;
  }
  std::string word() {
    const auto end = std::min(text_.find_first_of(std::string(kSpace) + "=/>", at_), text_.size());
    if (end == at_) fail("a name is missing");
    std::string result = text_.substr(at_, end - at_);
    at_ = end;
    return result;
  }
  char after_space() {
    at_ = std::min(text_.find_first_not_of(kSpace, at_), text_.size());
    if (at_ == text_.size()) fail("ends inside an element");
    return text_[at_];
  }
  void expect(char wanted) {
    if (after_space() != wanted) fail(std::string("'") + wanted + "' is missing");
    ++at_;
  }

  XmlElement element(int depth) {
    if (depth > kMaxDepth) fail("nested too deeply");
    XmlElement result;
    result.place.line = line();
    ++at_;
    result.tag = word();
    while (after_space() != '/' && text_[at_] != '>') {
      std::string name = word();
      expect('=');
      const char quote = after_space();
      if (quote != '"' && quote != '\'') fail("a value needs quotes");
      const auto begin = ++at_;
      skip_behind(std::string(1, quote));
      result.attributes.emplace_back(std::move(name), text_.substr(begin, at_ - 1 - begin));
    }
    if (text_[at_] == '/') {
      ++at_;
      expect('>');
      return result;
    }
    while (next_tag()) {
      if (text_.compare(at_, 2, "</") != 0) {
        result.add(element(depth + 1));
        continue;
      }
      at_ += 2;
      if (word() != result.tag) fail("'" + result.tag + "' ends under another name");
      expect('>');
      return result;
    }
    fail("'" + result.tag + "' does not end");
  }

  const std::string& text_;
  std::size_t at_ = 0, counted_ = 0;
  int line_ = 1;  ///< of `counted_`
};

const std::array<std::pair<const char*, const char*>, 5> kEntities{
    {{"&", "&amp;"}, {"<", "&lt;"}, {">", "&gt;"}, {"\"", "&quot;"}, {"'", "&apos;"}}};

/// One line for each element, more where a value has several, and one for the end of those with children.
void write(const XmlElement& element, const std::string& indent, PlacedText& placed) {
  std::string& out = placed.text;
  placed.lines.push_back(element.place);
  out += indent + "<" + element.tag;
  for (const auto& [name, value] : element.attributes) {
    placed.lines.insert(placed.lines.end(), std::ranges::count(value, '\n'), element.place);
    const char quote = value.find('"') == std::string::npos ? '"' : '\'';
    out += " " + name + "=" + quote + value + quote;
  }
  if (element.children.empty()) {
    out += "/>\n";
    return;
  }
  out += ">\n";
  for (const auto& child : element.children) write(child, indent + "  ", placed);
  placed.lines.push_back(element.place);
  out += indent + "</" + element.tag + ">\n";
}

}  // namespace

std::string XmlElement::get(const std::string& name) const {
  for (const auto& [key, value] : attributes) {
    if (key == name) return value;
  }
  return "";
}

void XmlElement::set(const std::string& name, std::string value) {
  for (auto& [key, old] : attributes) {
    if (key != name) continue;
    old = std::move(value);
    return;
  }
  attributes.emplace_back(name, std::move(value));
}

XmlElement parse_xml(const std::string& text) { return XmlParser(text).document(); }

std::vector<XmlElement> parse_xml_elements(const std::string& text) { return XmlParser(text).all(); }

std::string to_text(const XmlElement& element) { return to_placed_text(element).text; }

PlacedText to_placed_text(const XmlElement& element) {
  PlacedText result;
  write(element, "", result);
  return result;
}

std::string from_xml_value(const std::string& value) {
  std::string text;
  for (std::size_t at = 0; at < value.size(); ++at) {
    const auto entity = std::ranges::find_if(kEntities, [&](const auto& one) {
      return value.compare(at, std::string(one.second).size(), one.second) == 0;
    });
    if (entity == kEntities.end()) {
      text += value[at];
    } else {
      text += entity->first;
      at += std::string(entity->second).size() - 1;
    }
  }
  return text;
}

std::string to_xml_value(const std::string& text) {
  std::string value;
  for (const char c : text) {
    const auto entity = std::ranges::find_if(kEntities, [c](const auto& one) { return one.first[0] == c; });
    value += entity == kEntities.end() ? std::string(1, c) : entity->second;
  }
  return value;
}

}  // namespace flowscope
