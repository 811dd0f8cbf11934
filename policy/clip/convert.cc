#include "policy/clip/convert.h"

#include <torch/script.h>
#include <zlib.h>

#include <array>
#include <fstream>
#include <functional>
#include <memory>
#include <stdexcept>

#include "policy/clip/published.h"
#include "policy/clip/transformers_names.h"
#include "policy/clip/weights.h"
#include "policy/policy.h"

namespace flowscope {
namespace {

using std::filesystem::path;

constexpr std::size_t largest_merges = 4 << 20;  ///< bytes; the published ones take half a MiB

bool is_zip(const path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::array<char, 4> magic{};
  if (!stream) throw BadCheckpoint(file.string() + ": cannot be opened");
  stream.read(magic.data(), magic.size());
  return std::string(magic.data(), magic.size()) == std::string("PK\x03\x04", 4);
}

TensorsByName read_torch_script(const path& file) {
  try {
    const torch::jit::Module module = torch::jit::load(file.string(), torch::kCPU);
    TensorsByName tensors;
    for (const auto& item : module.named_parameters()) tensors[item.name] = item.value.detach();
    for (const auto& item : module.named_buffers()) tensors[item.name] = item.value;
    return tensors;
  } catch (const c10::Error& error) {
    throw BadCheckpoint(file.string() + ": is no whole TorchScript archive (pickled weights are not read): " +
                        error.what_without_backtrace());
  } catch (const std::exception& error) {
    throw BadCheckpoint(file.string() + ": is no whole TorchScript archive: " + error.what());
  }
}

// What is wrong in a file is said with the file's name.
template <typename Work>
auto in_file(const path& file, Work work) {
  try {
    return work();
  } catch (const std::invalid_argument& error) {
    throw BadCheckpoint(file.string() + ": " + error.what());
  }
}

TensorsByName take(const path& file, const TensorsByName& all, const std::vector<PublishedTensor>& wanted) {
  in_file(file, [&] { require_published(all, wanted); });
  TensorsByName taken;
  for (const PublishedTensor& tensor : wanted)
    taken[tensor.name] = clip_tensor(all, tensor.name, tensor.shape).contiguous();
  return taken;
}

// Exports of CLIP with a text tower of its own put these names behind a prefix.
void drop_text_prefix(TensorsByName& tensors) {
  constexpr std::string_view prefix = "text.";
  TensorsByName renamed;
  for (const auto& [name, tensor] : tensors)
    if (name.starts_with(prefix)) renamed[name.substr(prefix.size())] = tensor;
  tensors.merge(renamed);
}

std::int64_t parameters_of(const TensorsByName& tensors) {
  std::int64_t count = 0;
  for (const auto& [name, tensor] : tensors) count += tensor.numel();
  return count;
}

}  // namespace

TensorsByName read_foreign_weights(const path& file) {
  return is_zip(file) ? read_torch_script(file) : read_safetensors(file);
}

std::string read_merges(const path& file) {
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> stream(gzopen(file.c_str(), "rb"), gzclose);
  if (!stream) throw BadCheckpoint(file.string() + ": cannot be opened");
  std::string text;
  int lines = 0;
  // One line may be the version. The published file goes on with merges that CLIP does not use.
  while (lines <= ClipTokenizer::published_merges) {
    std::array<char, 1024> line{};
    if (!gzgets(stream.get(), line.data(), line.size())) break;
    text += line.data();
    if (text.size() > largest_merges) throw BadCheckpoint(file.string() + ": is no merges file: too long");
    if (text.ends_with('\n')) ++lines;
    if (lines == ClipTokenizer::published_merges && text.find("#version") > text.find('\n')) break;
  }
  int code = Z_OK;
  const char* message = gzerror(stream.get(), &code);
  if (code != Z_OK && code != Z_STREAM_END)
    throw BadCheckpoint(file.string() + ": is cut or damaged: " + message);
  return text;
}

ClipConverted convert_clip(const ClipConvertOptions& options) {
  if (options.image.empty() && options.text.empty())
    throw std::invalid_argument("clip: name a file for the image part, the text part or both");
  if (options.text.empty() != options.merges.empty())
    throw std::invalid_argument("clip: the text part and the merges file go together");
  if (options.out.empty()) throw std::invalid_argument("clip: name the file to write");
  TensorsByName image, text;
  std::string merges;
  if (!options.merges.empty()) {
    merges = read_merges(options.merges);
    const int found = in_file(options.merges, [&] { return ClipTokenizer(merges).vocabulary(); });
    const int wanted = static_cast<int>(clip_text_tensors().front().shape.front());
    if (found != wanted) {
      throw BadCheckpoint(options.merges.string() + ": its merges make a vocabulary of " +
                          std::to_string(found) + ", not " + std::to_string(wanted));
    }
  }
  TensorsByName all;
  if (!options.image.empty()) {
    all = read_foreign_weights(options.image);
    image = take(options.image, all, clip_image_tensors());
  }
  if (!options.text.empty()) {
    if (options.text != options.image) all = read_foreign_weights(options.text);
    drop_text_prefix(all);
    in_file(options.text, [&] { add_published_names(all); });
    text = take(options.text, all, clip_text_tensors());
  }
  all.clear();
  return {.identity = write_clip(options.out, image, text, merges),
          .image_parameters = parameters_of(image),
          .text_parameters = parameters_of(text)};
}

}  // namespace flowscope
