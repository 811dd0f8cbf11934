#include "policy/clip/published.h"

#include <sstream>
#include <stdexcept>

namespace flowscope {
namespace {

using Shape = std::vector<std::int64_t>;

void add_norm(std::vector<PublishedTensor>& out, const std::string& name, std::int64_t channels) {
  for (const char* part : {"weight", "bias", "running_mean", "running_var"})
    out.push_back({name + "." + part, {channels}});
}

void add_conv(std::vector<PublishedTensor>& out, const std::string& conv, const std::string& norm,
              std::int64_t to, std::int64_t from, std::int64_t kernel) {
  out.push_back({conv + ".weight", {to, from, kernel, kernel}});
  add_norm(out, norm, to);
}

void add_weight_and_bias(std::vector<PublishedTensor>& out, const std::string& name, Shape weight) {
  const std::int64_t rows = weight.front();
  out.push_back({name + ".weight", std::move(weight)});
  out.push_back({name + ".bias", {rows}});
}

// Empty when `tensor` is of the shape.
std::string complaint_about(const torch::Tensor& tensor, const std::string& name, const Shape& shape) {
  bool fits = tensor.dim() == static_cast<std::int64_t>(shape.size());
  for (std::size_t d = 0; fits && d < shape.size(); ++d)
    fits = shape[d] < 0 || tensor.size(static_cast<std::int64_t>(d)) == shape[d];
  if (fits && tensor.is_floating_point()) return "";
  std::ostringstream text;
  text << "tensor " << name << " is " << torch::toString(tensor.scalar_type()) << " " << tensor.sizes()
       << ", not floating point " << at::IntArrayRef(shape);
  return text.str();
}

}  // namespace

std::vector<PublishedTensor> clip_image_tensors() {
  std::vector<PublishedTensor> out;
  add_conv(out, "visual.conv1", "visual.bn1", 32, 3, 3);
  add_conv(out, "visual.conv2", "visual.bn2", 32, 32, 3);
  add_conv(out, "visual.conv3", "visual.bn3", 64, 32, 3);
  constexpr int blocks[] = {3, 4, 6, 3};
  std::int64_t from = 64;
  for (int layer = 0; layer < 4; ++layer) {
    const std::int64_t narrow = std::int64_t{64} << layer, to = 4 * narrow;
    for (int block = 0; block < blocks[layer]; ++block, from = to) {
      const std::string name = "visual.layer" + std::to_string(layer + 1) + "." + std::to_string(block) + ".";
      add_conv(out, name + "conv1", name + "bn1", narrow, from, 1);
      add_conv(out, name + "conv2", name + "bn2", narrow, narrow, 3);
      add_conv(out, name + "conv3", name + "bn3", to, narrow, 1);
      if (block == 0) add_conv(out, name + "downsample.0", name + "downsample.1", to, from, 1);
    }
  }
  return out;
}

std::vector<PublishedTensor> clip_text_tensors() {
  constexpr std::int64_t width = 512, context = 77, vocabulary = 49408;
  constexpr int blocks = 12;
  std::vector<PublishedTensor> out{{"token_embedding.weight", {vocabulary, width}},
                                   {"positional_embedding", {context, width}}};
  for (int block = 0; block < blocks; ++block) {
    const std::string name = "transformer.resblocks." + std::to_string(block) + ".";
    add_weight_and_bias(out, name + "ln_1", {width});
    out.push_back({name + "attn.in_proj_weight", {3 * width, width}});
    out.push_back({name + "attn.in_proj_bias", {3 * width}});
    add_weight_and_bias(out, name + "attn.out_proj", {width, width});
    add_weight_and_bias(out, name + "ln_2", {width});
    add_weight_and_bias(out, name + "mlp.c_fc", {4 * width, width});
    add_weight_and_bias(out, name + "mlp.c_proj", {width, 4 * width});
  }
  add_weight_and_bias(out, "ln_final", {width});
  return out;
}

void require_published(const TensorsByName& tensors, const std::vector<PublishedTensor>& wanted) {
  constexpr std::size_t most_named = 4;
  std::vector<std::string> problems;
  for (const PublishedTensor& tensor : wanted) {
    const auto found = tensors.find(tensor.name);
    const std::string problem = found == tensors.end()
                                    ? "tensor " + tensor.name + " is missing"
                                    : complaint_about(found->second, tensor.name, tensor.shape);
    if (!problem.empty()) problems.push_back(problem);
  }
  if (problems.empty()) return;
  std::string text;
  for (std::size_t i = 0; i < std::min(most_named, problems.size()); ++i)
    text += (i ? "; " : "") + problems[i];
  if (problems.size() > most_named) text += "; and " + std::to_string(problems.size() - most_named) + " more";
  throw std::invalid_argument(text);
}

torch::Tensor clip_tensor(const TensorsByName& tensors, const std::string& name, const Shape& shape) {
  const auto found = tensors.find(name);
  if (found == tensors.end()) throw std::invalid_argument("tensor " + name + " is missing");
  const std::string problem = complaint_about(found->second, name, shape);
  if (!problem.empty()) throw std::invalid_argument(problem);
  return found->second.detach().to(torch::kFloat32);
}

}  // namespace flowscope
