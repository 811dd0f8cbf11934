#include "web/incoming_meter.h"

namespace flowscope::web {

void IncomingMeter::transfer_read_bytes(std::size_t size) {
  left_ -= std::min(left_, size);
  open_bytes_ += size;
}

bool IncomingMeter::tick() {
  const bool flooded = left_ == 0;
  left_ = std::min(most_at_once, left_ + per_second);
  open_s_ = open_bytes_ > 0 ? open_s_ + 1 : 0;
  return flooded || open_s_ >= longest_message_s;
}

}  // namespace flowscope::web
