// CLIP's byte-pair tokenizer: an instruction as ids of its text transformer's vocabulary. Source: Sennrich et
// al. 2016 (arXiv 1508.07909) over bytes, with the vocabulary published with CLIP (arXiv 2103.00020, §2.4).
#pragma once

#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace flowscope {

struct ClipToken {
  int id = 0;
  std::string piece;  ///< the word, mark or digit that it is (a part of), lower-cased; empty at start and end
  bool operator==(const ClipToken&) const = default;
};

/// Ids count the 256 bytes, the 256 bytes that end a piece, the merges in their order, start and end. Texts
/// are lower-cased and blanks collapse; there is no Unicode normalisation and no repair of broken or HTML
/// text. Immutable, so any thread may use it.
class ClipTokenizer {
 public:
  static constexpr int context = 77;  ///< tokens that the published text transformer takes at most
  static constexpr int published_merges = 48894;  ///< start is 49406, end 49407

  /// `merges`: one pair "left right" per line, best first; a first line with "#version" and empty lines at
  /// the end do not count. Throws std::invalid_argument naming the line that is not a pair of symbols.
  explicit ClipTokenizer(std::string_view merges);

  /// At most `limit` tokens (at least 2), start and end included: what is too long loses its last pieces,
  /// never the end. Throws std::invalid_argument for a text that is not UTF-8.
  std::vector<ClipToken> encode(std::string_view text, int limit = context) const;

  int start() const { return start_; }
  int end() const { return start_ + 1; }
  int vocabulary() const { return start_ + 2; }

 private:
  std::vector<int> merge_bytes(std::string_view piece) const;

  std::vector<std::string> byte_symbol_;  ///< of each byte: one printable character, UTF-8
  std::unordered_map<std::string, int> id_, rank_;
  int start_ = 0;
};

}  // namespace flowscope
