#include "policy/clip/transformers_names.h"

#include <stdexcept>
#include <utility>
#include <vector>

namespace flowscope {
namespace {

const std::string root = "text_model.";

torch::Tensor joined(const TensorsByName& tensors, const std::string& attention, const std::string& part) {
  std::vector<torch::Tensor> rows;
  for (const char* projection : {"q_proj", "k_proj", "v_proj"}) {
    const std::string name = attention + projection + "." + part;
    const auto found = tensors.find(name);
    if (found == tensors.end()) throw std::invalid_argument("tensor " + name + " is missing");
    const torch::Tensor& row = found->second;
    const bool fits =
        row.dim() > 0 && row.is_floating_point() && (rows.empty() || row.sizes() == rows.front().sizes());
    if (!fits) throw std::invalid_argument("tensor " + name + " does not fit the other projections");
    rows.push_back(row);
  }
  return torch::cat(rows);
}

}  // namespace

void add_published_names(TensorsByName& tensors) {
  TensorsByName added;
  const auto rename = [&](const std::string& from, const std::string& to) {
    for (const char* part : {"", ".weight", ".bias"}) {
      const auto found = tensors.find(root + from + part);
      if (found != tensors.end()) added[to + part] = found->second;
    }
  };
  rename("embeddings.token_embedding", "token_embedding");
  rename("embeddings.position_embedding.weight", "positional_embedding");
  rename("final_layer_norm", "ln_final");
  for (int block = 0;; ++block) {
    const std::string from = "encoder.layers." + std::to_string(block) + ".";
    if (!tensors.contains(root + from + "self_attn.q_proj.weight")) break;
    const std::string to = "transformer.resblocks." + std::to_string(block) + ".";
    for (const auto& [theirs, published] : {std::pair{"layer_norm1", "ln_1"},
                                            {"layer_norm2", "ln_2"},
                                            {"self_attn.out_proj", "attn.out_proj"},
                                            {"mlp.fc1", "mlp.c_fc"},
                                            {"mlp.fc2", "mlp.c_proj"}})
      rename(from + theirs, to + published);
    for (const char* part : {"weight", "bias"})
      added[to + "attn.in_proj_" + part] = joined(tensors, root + from + "self_attn.", part);
  }
  tensors.merge(added);
}

}  // namespace flowscope
