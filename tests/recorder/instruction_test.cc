#include "recorder/instruction.h"

#include <gtest/gtest.h>

namespace flowscope {
namespace {

using Words = std::vector<std::string>;

TEST(Instruction, IsReadWordByWordInAnyScript) {
  EXPECT_EQ(split_words("Push the RED button, then 2 others."),
            (Words{"push", "the", "red", "button", "then", "2", "others"}));
  EXPECT_EQ(split_words("push the “red” button – now…"), (Words{"push", "the", "red", "button", "now"}));
  EXPECT_EQ(split_words("打开抽屉。"), (Words{"打开抽屉"}));
  EXPECT_EQ(split_words("schließe\u00a0die Tür"), (Words{"schließe", "die", "tür"}));
  for (const char* silent : {"", "   ", "…!?", "--", "“”"}) EXPECT_FALSE(has_word(silent)) << silent;
  EXPECT_EQ(split_words("cut \xE6"), (Words{"cut", "\xE6"})) << "a text that ends within a character";
}

}  // namespace
}  // namespace flowscope
