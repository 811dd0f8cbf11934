// Instructions as tokens. A colour word carries its RGB value, which stands in for what a large text encoder
// knows.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "recorder/instruction.h"

namespace flowscope {

/// RGB in [0, 1] of the benchmark's 20 colour names, nothing for other words.
std::optional<Eigen::Vector3f> color_of_word(std::string_view word);

struct Word {
  int row = 0;                     ///< in the embedding table; 0 pads, 1 is any colour, 2 unknown
  int mention = 0;                 ///< 1, 2, … for the first, second, … colour word; 0 for the others
  Eigen::Vector3f color{0, 0, 0};  ///< of a colour word
  std::shared_ptr<const std::vector<float>> feature =
      nullptr;  ///< of a frozen text encoder; null: learnt table
  bool operator==(const Word&) const = default;
};

/// Another way to make words of an instruction, a frozen text encoder's (policy/clip/phrases.h).
class PhraseEncoder {
 public:
  virtual ~PhraseEncoder() = default;
  /// At most `limit` words. Throws std::invalid_argument for a text that it cannot read.
  virtual std::vector<Word> encode(const std::string& instruction, int limit) const = 0;
};

/// Grows while demonstrations come in; stored with the weights. Colour words share one row, so that
/// recolouring an instruction is a change of `Word::color` alone.
class Vocabulary {
 public:
  static constexpr int pad = 0, color = 1, unknown = 2, first = 3;

  explicit Vocabulary(int capacity = 256) : capacity_(capacity) {}
  /// Gives new words their rows; words beyond the capacity stay unknown.
  void learn(std::string_view instruction);
  /// At most `limit` words. Throws std::invalid_argument for an instruction without a word.
  std::vector<Word> encode(std::string_view instruction, int limit) const;
  /// From now on words come from `encoder`; nothing is learnt here.
  void use(std::shared_ptr<const PhraseEncoder> encoder) { encoder_ = std::move(encoder); }
  const std::vector<std::string>& known() const { return known_; }
  void restore(std::vector<std::string> known) { known_ = std::move(known); }

 private:
  int capacity_;
  std::vector<std::string> known_;
  std::shared_ptr<const PhraseEncoder> encoder_;
};

}  // namespace flowscope
