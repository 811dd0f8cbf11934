// The text transformer under the names that Hugging Face's transformers library gives it ("text_model.…"),
// brought to the published names (published.h). Its three projections of an attention are one tensor there.
#pragma once

#include "policy/safetensors.h"

namespace flowscope {

/// Adds the published names; nothing changes when there is no "text_model.…". Throws std::invalid_argument
/// naming a tensor of a begun block that is missing or cannot be joined with its neighbours.
void add_published_names(TensorsByName& tensors);

}  // namespace flowscope
