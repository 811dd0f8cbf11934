#include "recorder/xml_tree.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace flowscope {
namespace {

TEST(XmlTree, KeepsElementsAndAttributesInOrder) {
  const XmlElement root = parse_xml(
      "<?xml version='1.0'?>\n<!-- <no> -->\n<a  x = '1' y=\"&lt;2\">words<b/>\n<!-- > --><c z=''><b k='say "
      "\"no\"'/></c ></a>");
  EXPECT_EQ(root.tag, "a");
  EXPECT_EQ(root.get("x"), "1");
  EXPECT_EQ(root.get("none"), "");
  ASSERT_EQ(root.children.size(), 2u);
  EXPECT_EQ(root.children[1].children[0].get("k"), "say \"no\"");
  const std::string text = to_text(root);
  EXPECT_EQ(text, "<a x=\"1\" y=\"&lt;2\">\n  <b/>\n  <c z=\"\">\n    <b k='say \"no\"'/>\n  </c>\n</a>\n");
  EXPECT_EQ(to_text(parse_xml(text)), text);
}

TEST(XmlTree, SetsAndAdds) {
  XmlElement root = parse_xml("<a x='1'/>");
  root.set("x", "2");
  root.set("y", "3");
  root.add({"b", {}, {}});
  EXPECT_EQ(to_text(root), "<a x=\"2\" y=\"3\">\n  <b/>\n</a>\n");
}

TEST(XmlTree, KnowsWhereEachElementWasRead) {
  const XmlElement root =
      parse_xml("<?xml version='1.0'?>\n<!--\n--><a\n x='1\n2'>\n\n<b/> <c>\n</c><d/></a>");
  EXPECT_EQ(root.place.line, 3);
  EXPECT_EQ(root.children.at(0).place.line, 7);
  EXPECT_EQ(root.children.at(1).place.line, 7);
  EXPECT_EQ(root.children.at(2).place.line, 8);
  XmlElement longer = root;
  longer.children.insert(longer.children.begin(), {"new", {}, {}});
  const PlacedText placed = to_placed_text(longer);
  EXPECT_EQ(placed.text, "<a x=\"1\n2\">\n  <new/>\n  <b/>\n  <c/>\n  <d/>\n</a>\n");
  std::vector<int> lines;
  for (const XmlPlace& place : placed.lines) lines.push_back(place.line);
  EXPECT_EQ(lines, (std::vector<int>{3, 3, 0, 7, 7, 8, 3})) << "what was added has none";
}

TEST(XmlTree, ValuesAndWhatTheyMean) {
  EXPECT_EQ(from_xml_value("a &amp;&lt;b&gt; &quot;c&quot; &apos; & &x;"), "a &<b> \"c\" ' & &x;");
  EXPECT_EQ(to_xml_value("a &<\"'"), "a &amp;&lt;&quot;&apos;");
}

TEST(XmlTree, WhatIsNoXmlNamesItsLine) {
  for (const char* text : {"", "words", "<a", "<a>", "<a>\n<b></a>", "<a x>", "<a x=1/>", "<a x='1/>", "<a/",
                           "<!-- <a/>", "< a/>", "<a></b>"}) {
    try {
      parse_xml(text);
      ADD_FAILURE() << text;
    } catch (const std::runtime_error& error) {
      EXPECT_EQ(std::string(error.what()).rfind("line ", 0), 0u) << error.what();
    }
  }
  std::string deep;
  for (int i = 0; i < 100'000; ++i) deep += "<a>";
  EXPECT_THROW(parse_xml(deep), std::runtime_error);
}

}  // namespace
}  // namespace flowscope
