#include "policy/on_device.h"

#include <stdexcept>

namespace flowscope {
namespace {

// A field that is added to a batch must be moved too.
static_assert(sizeof(SceneBatch) == 15 * sizeof(torch::Tensor),
              "name the new field in on_device(SceneBatch)");
static_assert(sizeof(DrawBatch) == 7 * sizeof(torch::Tensor), "name the new field in on_device(DrawBatch)");

void move_all(std::initializer_list<torch::Tensor*> tensors, const torch::Device& device) {
  for (torch::Tensor* tensor : tensors)
    if (tensor->defined()) *tensor = tensor->to(device);
}

}  // namespace

torch::Device device_of(const std::string& name) {
  if (name == "cpu") return torch::kCPU;
  if (name != "cuda" && name.rfind("cuda:", 0) != 0)
    throw std::invalid_argument("device '" + name + "' is neither cpu nor cuda");
  if (!torch::cuda::is_available())
    throw std::invalid_argument("device '" + name +
                                "': this LibTorch finds no CUDA device; build against one with CUDA "
                                "(-DTorch_DIR=…) on a machine that has such a device, or take cpu");
  const std::string digits = name.size() > 5 ? name.substr(5) : "0";
  if (digits.empty() || digits.size() > 3 || digits.find_first_not_of("0123456789") != std::string::npos ||
      static_cast<std::size_t>(std::stoi(digits)) >= torch::cuda::device_count())
    throw std::invalid_argument("device '" + name + "': there are " +
                                std::to_string(torch::cuda::device_count()) +
                                " CUDA devices, from cuda:0 on");
  return torch::Device(name);
}

SceneBatch on_device(SceneBatch b, const torch::Device& device) {
  move_all({&b.word_row, &b.word_mention, &b.word_color, &b.word_feature, &b.image_feature, &b.image_position,
            &b.image_moments, &b.image_color, &b.patches, &b.pictures, &b.patch_place, &b.word_feature,
            &b.pictures, &b.patch_place, &b.history, &b.history_position, &b.tool_axes, &b.keyframe_index},
           device);
  return b;
}

DrawBatch on_device(DrawBatch b, const torch::Device& device) {
  move_all({&b.x, &b.t, &b.region_feature, &b.region_position, &b.region_place, &b.region_moments,
            &b.region_color},
           device);
  return b;
}

}  // namespace flowscope
