// Who holds the server's connections, and who has to go when they run out. I/O thread only.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

namespace flowscope::web {

/// A guest is a stranger until it has shown what the server asks for; a stranger's connection may be closed
/// for another's sake whenever the server waits for it to say something.
class Places {
  struct Guest;

 public:
  /// `most` in all; the last `kept` of them are out of strangers' reach.
  Places(int most, int kept) : most_(most), kept_(kept) {}
  Places(const Places&) = delete;
  Places& operator=(const Places&) = delete;

  /// One guest's hold on its place; gives it back when destroyed. `Places` must outlive it.
  class Hold {
   public:
    Hold(Places& places, std::shared_ptr<Guest> guest) : places_(places), guest_(std::move(guest)) {}
    ~Hold() { places_.remove(guest_.get()); }
    Hold(const Hold&) = delete;
    Hold& operator=(const Hold&) = delete;
    void make_known();  ///< no stranger any more
    void waits();       ///< for the guest's next word
    void works();       ///< for the guest: it is not sent away now

   private:
    Places& places_;
    std::shared_ptr<Guest> guest_;
  };

  /// A stranger's place. With none free the stranger who came first has to go; with no stranger to send away,
  /// the known guest that has been silent longest. `leave` closes the guest's connection. Null when everybody
  /// is being worked for.
  std::unique_ptr<Hold> take(std::function<void()> leave);
  /// Sends one silent guest away, strangers first. False when there is none.
  bool make_room() { return send_away(true); }
  int taken() const { return static_cast<int>(guests_.size()); }

 private:
  struct Guest {
    bool known = false, waiting = true;
    std::uint64_t since = 0;  ///< a stranger: when it came; a known guest: when it fell silent
    std::function<void()> leave;
  };
  bool send_away(bool known_too);
  void remove(const Guest* guest);
  int most_, kept_;
  std::uint64_t clock_ = 0;  ///< counts what happens
  std::vector<std::shared_ptr<Guest>> guests_;
};

using PlaceHold = std::unique_ptr<Places::Hold>;

}  // namespace flowscope::web
