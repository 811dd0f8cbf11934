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
