#include <gtest/gtest.h>

#include <stdexcept>

#include "policy/clip/characters.h"
#include "policy/clip/split_text.h"
#include "policy/clip/tokenizer.h"

namespace flowscope {
namespace {

using Ids = std::vector<int>;
using Pieces = std::vector<std::string>;

// Worked by hand: "!" is 0, "a" is 64, "é" is bytes C3 A9 = 127 and 102; a byte that ends a piece is 256
// more; the merges follow from 512 on, then start and end.
constexpr const char* tiny_merges = "#version: 0.2\nl o\nlo w</w>\nr e\nre d</w>\n";
constexpr int start = 516, end = 517;

Ids ids_of(const std::string& text, int limit = ClipTokenizer::context) {
  Ids ids;
  for (const ClipToken& token : ClipTokenizer(tiny_merges).encode(text, limit)) ids.push_back(token.id);
  return ids;
}

TEST(ClipTokenizer, MergesTheBestPairFirst) {
  EXPECT_EQ(ids_of("low red"), (Ids{start, 513, 515, end}));
  // "w" does not end "lower", so its second merge does not apply; "re" is never side by side.
  EXPECT_EQ(ids_of("lower"), (Ids{start, 512, 86, 68, 337, end}));
  EXPECT_EQ(ids_of("lolow"), (Ids{start, 512, 513, end}));
  EXPECT_EQ(ids_of(""), (Ids{start, end}));
}

TEST(ClipTokenizer, AppliesMergesByRankAndNotByPlace) {
  const ClipTokenizer tokenizer("b c\na b\n");
  Ids ids;
  for (const ClipToken& token : tokenizer.encode("abcd")) ids.push_back(token.id);
  EXPECT_EQ(ids, (Ids{514, 64, 512, 67 + 256, 515}));
}

TEST(ClipTokenizer, GivesSingleLettersTheirPublishedIds) {
  // In CLIP's vocabulary "a" as a word is 320 and "!" is 256.
  EXPECT_EQ(ids_of("a !"), (Ids{start, 320, 256, end}));
}

TEST(ClipTokenizer, LowersCaseAndCollapsesBlanks) {
  EXPECT_EQ(ids_of("  LOW\t\n\u00a0 ReD "), ids_of("low red"));
  EXPECT_EQ(ids_of("É"), (Ids{start, 127, 102 + 256, end}));
  EXPECT_EQ(ids_of("É"), ids_of("é"));
}

TEST(ClipTokenizer, SplitsByThePublishedRules) {
  EXPECT_EQ(split_text("it's 12!? we'll"), (Pieces{"it", "'s", "1", "2", "!?", "we", "'ll"}));
  EXPECT_EQ(split_text("don't!'s x-y"), (Pieces{"don", "'t", "!'", "s", "x", "-", "y"}));
  EXPECT_EQ(split_text("Größe²日本٣"), (Pieces{"größe", "²", "日本", "٣"}));
  EXPECT_EQ(split_text("a<|endoftext|>b<|end"), (Pieces{"a", "<|endoftext|>", "b", "<|", "end"}));
  EXPECT_EQ(ids_of("it's 12!?"), (Ids{start, 72, 339, 6, 338, 272, 273, 0, 286, end}));
}

TEST(ClipTokenizer, WritesWhatHasNoMergeInBytes) {
  EXPECT_EQ(ids_of("😀"), (Ids{start, 172, 253, 246, 222 + 256, end}));
  EXPECT_EQ(ids_of(std::string("a\0b", 3)), (Ids{start, 320, 188 + 256, 321, end}));
}

TEST(ClipTokenizer, SaysWhichWordATokenIsOf) {
  const auto tokens = ClipTokenizer(tiny_merges).encode("Lower red");
  ASSERT_EQ(tokens.size(), 7u);
  EXPECT_EQ(tokens[0].piece, "");
  for (int i = 1; i < 5; ++i) EXPECT_EQ(tokens[i].piece, "lower");
  EXPECT_EQ(tokens[5], (ClipToken{515, "red"}));
}

TEST(ClipTokenizer, CutsBeforeTheEnd) {
  EXPECT_EQ(ids_of("low red low", 4), (Ids{start, 513, 515, end}));
  EXPECT_EQ(ids_of("low red low", 2), (Ids{start, end}));
  EXPECT_EQ(ids_of(std::string(300, '1')).size(), 77u);
  EXPECT_THROW(ids_of("low", 1), std::invalid_argument);
}

TEST(ClipTokenizer, RefusesTextThatIsNotUtf8) {
  for (const char* bad : {"ab\xff", "ab\xc3", "ab\xc0\xaf", "ab\xed\xa0\x80", "ab\xf5\x80\x80\x80"}) {
    try {
      split_text(bad);
      ADD_FAILURE() << "accepted " << bad;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find("byte 2"), std::string::npos) << error.what();
    }
  }
}

TEST(ClipTokenizer, NamesTheLineThatIsNoPair) {
  for (const char* bad : {"l o\nlow\n", "l o\n\nr e\n", "l o\nl o w\n", "l o\n low\n"}) {
    try {
      ClipTokenizer tokenizer(bad);
      ADD_FAILURE() << "accepted " << bad;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find("line 2"), std::string::npos) << error.what();
    }
  }
  EXPECT_EQ(ClipTokenizer("l o\r\nlo w</w>\r\n").vocabulary(), 516);
}

TEST(Characters, KnowTheirClassAndLowerCase) {
  EXPECT_TRUE(is_letter(U'z') && is_letter(U'ß') && is_letter(U'日') && is_letter(0x3134A));
  EXPECT_FALSE(is_letter(U'0') || is_letter(U'_') || is_letter(0x3134B) || is_letter(0));
  EXPECT_TRUE(is_number(U'7') && is_number(U'½') && is_number(U'Ⅷ'));
  EXPECT_FALSE(is_number(U'a') || is_number(U'日'));
  EXPECT_EQ(to_lower(U'Ā'), U'ā');
  EXPECT_EQ(to_lower(U'ā'), U'ā');
  EXPECT_EQ(to_lower(U'Ω'), U'ω');
  EXPECT_EQ(to_lower(U'Я'), U'я');
  EXPECT_EQ(to_lower(U'['), U'[');
}

}  // namespace
}  // namespace flowscope
