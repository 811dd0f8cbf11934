#include "web/places.h"

#include <algorithm>

namespace flowscope::web {

void Places::Hold::make_known() { guest_->known = true; }

void Places::Hold::waits() {
  guest_->waiting = true;
  if (guest_->known) guest_->since = ++places_.clock_;
}

void Places::Hold::works() { guest_->waiting = false; }

std::unique_ptr<Places::Hold> Places::take(std::function<void()> leave) {
  const auto strangers =
      std::count_if(guests_.begin(), guests_.end(), [](const auto& guest) { return !guest->known; });
  if (taken() >= most_) {
    if (!send_away(true)) return nullptr;
  } else if (strangers >= most_ - kept_) {
    if (!send_away(false)) return nullptr;
  }
  auto guest = std::make_shared<Guest>();
  guest->since = ++clock_;
  guest->leave = std::move(leave);
  guests_.push_back(guest);
  return std::make_unique<Hold>(*this, std::move(guest));
}

bool Places::send_away(bool known_too) {
  std::shared_ptr<Guest> first;
  for (const auto& guest : guests_) {
    if (!guest->waiting || (guest->known && !known_too)) continue;
    if (!first || guest->known < first->known ||
        (guest->known == first->known && guest->since < first->since))
      first = guest;
  }
  if (!first) return false;
  remove(first.get());
  first->leave();
  return true;
}

void Places::remove(const Guest* guest) {
  std::erase_if(guests_, [&](const auto& other) { return other.get() == guest; });
}

}  // namespace flowscope::web
