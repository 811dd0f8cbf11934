#include "policy/clip/weights.h"

#include <cstdint>
#include <cstring>
#include <span>
#include <sstream>
#include <stdexcept>

#include "policy/clip/published.h"
#include "policy/container.h"
#include "policy/policy.h"
#include "recorder/sha256.h"

namespace flowscope {
namespace {

constexpr const char* kind = "clip/1";
constexpr const char* merges_name = "merges";

std::span<const std::uint8_t> bytes_of(const torch::Tensor& dense) {
  return {static_cast<const std::uint8_t*>(dense.data_ptr()), dense.nbytes()};
}

// Of each tensor first, so that no second copy of all weights is needed.
std::string identity_of(const std::vector<NamedTensor>& tensors) {
  std::ostringstream lines;
  for (const NamedTensor& named : tensors)
    lines << named.name << " " << named.tensor.sizes() << " " << sha256_hex(bytes_of(named.tensor)) << "\n";
  const std::string text = lines.str();
  return sha256_hex({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

void add_published(std::vector<NamedTensor>& out, const TensorsByName& from,
                   const std::vector<PublishedTensor>& wanted) {
  if (from.empty()) return;
  require_published(from, wanted);
  for (const PublishedTensor& tensor : wanted)
    out.push_back({tensor.name, clip_tensor(from, tensor.name, tensor.shape).contiguous()});
}

ClipTokenizer tokenizer_for(std::string_view merges, std::int64_t vocabulary) {
  ClipTokenizer tokenizer(merges);
  if (tokenizer.vocabulary() == vocabulary) return tokenizer;
  throw std::invalid_argument("merges: they make a vocabulary of " + std::to_string(tokenizer.vocabulary()) +
                              ", the text transformer has " + std::to_string(vocabulary));
}

// The trunk and the text transformer have no name in common.
bool holds_any(const TensorsByName& tensors, const std::vector<PublishedTensor>& wanted) {
  for (const PublishedTensor& tensor : wanted)
    if (tensors.contains(tensor.name)) return true;
  return false;
}

ClipEncoders encoders_of(const Container& container, torch::Device device) {
  const auto found_kind = container.text.find("kind"), identity = container.text.find("identity");
  if (found_kind == container.text.end() || found_kind->second != kind || identity == container.text.end())
    throw std::invalid_argument(std::string("text \"kind\": this is no container of \"") + kind + "\"");
  TensorsByName tensors;
  for (const NamedTensor& named : container.tensors) tensors[named.name] = named.tensor;
  ClipEncoders encoders;
  encoders.identity = identity->second;
  if (holds_any(tensors, clip_image_tensors())) {
    require_published(tensors, clip_image_tensors());
    encoders.image = std::make_shared<ClipResNet>(tensors, device);
  }
  if (holds_any(tensors, clip_text_tensors())) {
    require_published(tensors, clip_text_tensors());
    encoders.text = std::make_shared<ClipTextEncoder>(tensors, device);
    const auto merges = tensors.find(merges_name);
    if (merges == tensors.end() || merges->second.scalar_type() != torch::kUInt8)
      throw std::invalid_argument("tensor merges is missing");
    const auto bytes = bytes_of(merges->second);
    encoders.tokenizer = std::make_shared<ClipTokenizer>(tokenizer_for(
        {reinterpret_cast<const char*>(bytes.data()), bytes.size()}, encoders.text->vocabulary()));
  }
  if (!encoders.image && !encoders.text)
    throw std::invalid_argument("it holds neither an image nor a text part");
  return encoders;
}

}  // namespace

ClipEncoders read_clip(const std::filesystem::path& path, torch::Device device) {
  const Container container = read_container(path);
  try {
    return encoders_of(container, device);
  } catch (const std::invalid_argument& error) {
    throw BadCheckpoint(path.string() + ": " + error.what());
  }
}

std::string write_clip(const std::filesystem::path& path, const TensorsByName& image,
                       const TensorsByName& text, std::string_view merges) {
  if (image.empty() && text.empty())
    throw std::invalid_argument("clip: there is neither an image nor a text part");
  Container container;
  add_published(container.tensors, image, clip_image_tensors());
  if (!text.empty()) {
    add_published(container.tensors, text, clip_text_tensors());
    tokenizer_for(merges, text.at("token_embedding.weight").size(0));
    const torch::Tensor bytes = torch::empty({static_cast<std::int64_t>(merges.size())}, torch::kUInt8);
    std::memcpy(bytes.data_ptr(), merges.data(), merges.size());
    container.tensors.push_back({merges_name, bytes});
  }
  const std::string identity = identity_of(container.tensors);
  container.text = {{"kind", kind}, {"identity", identity}};
  write_container(path, container);
  return identity;
}

}  // namespace flowscope
