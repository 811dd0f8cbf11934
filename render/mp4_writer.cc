#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include "render/encode.h"
#include "render/mp4_boxes.h"
#include "render/new_file.h"

extern char** environ;

namespace flowscope {

namespace {

class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }
  void close() {
    if (fd_ >= 0) ::close(std::exchange(fd_, -1));
  }

 private:
  int fd_;
};

constexpr int patience_ms = 20;  ///< between two looks whether somebody asked to stop

void stop_if_asked(const std::stop_token& stop) {
  if (stop.stop_requested()) throw std::runtime_error("MP4: stopped");
}

/// The ffmpeg program, fed through its standard input. A socket instead of a pipe: its death is an error code
/// here, not a signal.
class Ffmpeg {
 public:
  Ffmpeg(std::vector<std::string> arguments, std::stop_token stop)
      : Ffmpeg(std::move(arguments), open_sockets()) {
    stop_ = std::move(stop);
  }
  ~Ffmpeg() {
    if (pid_ <= 0) return;
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  Ffmpeg(const Ffmpeg&) = delete;
  Ffmpeg& operator=(const Ffmpeg&) = delete;

  /// False when the program no longer reads.
  bool send(const std::vector<std::uint8_t>& bytes) {
    std::size_t done = 0;
    while (done < bytes.size()) {
      stop_if_asked(stop_);
      const ssize_t count =
          ::send(input_.get(), bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL | MSG_DONTWAIT);
      if (count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
        pollfd room{input_.get(), POLLOUT, 0};
        ::poll(&room, 1, patience_ms);
        continue;
      }
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) return false;
      done += static_cast<std::size_t>(count);
    }
    return true;
  }

  /// Ends the input and waits; true when it succeeded.
  bool wait() {
    input_.close();
    if (pid_ <= 0) return false;
    int status = 0;
    for (pid_t ended = 0; ended != pid_;) {
      stop_if_asked(stop_);
      ended = ::waitpid(pid_, &status, WNOHANG);
      if (ended < 0 && errno != EINTR) return pid_ = -1, false;
      if (ended == 0) ::poll(nullptr, 0, patience_ms);
    }
    pid_ = -1;
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
  }

  /// What it has written to its standard error: the last 2000 bytes.
  std::string complaint() const {
    const off_t size = ::lseek(errors_.get(), 0, SEEK_END);
    std::string text(static_cast<std::size_t>(std::min<off_t>(std::max<off_t>(size, 0), 2000)), '\0');
    const ssize_t count =
        ::pread(errors_.get(), text.data(), text.size(), size - static_cast<off_t>(text.size()));
    text.resize(static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    return text;
  }

 private:
  static std::array<int, 2> open_sockets() {
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
      throw std::system_error(errno, std::generic_category(), "cannot feed ffmpeg");
    }
    return ends;
  }

  Ffmpeg(std::vector<std::string> arguments, const std::array<int, 2>& ends)
      : input_(ends[0]), errors_(::memfd_create("ffmpeg", MFD_CLOEXEC)) {
    const Descriptor childs_end(ends[1]);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_adddup2(&actions, childs_end.get(), STDIN_FILENO);
    ::posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    ::posix_spawn_file_actions_adddup2(&actions, errors_.get(), STDERR_FILENO);
    const int error = ::posix_spawnp(&pid_, argv[0], &actions, nullptr, argv.data(), environ);
    ::posix_spawn_file_actions_destroy(&actions);
    if (error == 0) return;
    pid_ = -1;
    if (error == ENOENT) throw std::runtime_error("MP4: ffmpeg not found; install the Debian package ffmpeg");
    throw std::system_error(error, std::generic_category(), "MP4: cannot start ffmpeg");
  }

  Descriptor input_, errors_;
  pid_t pid_ = -1;
  std::stop_token stop_;
};

int even(int n) { return n + n % 2; }

/// Constant rate, 8-bit yuv420p in BT.709, a key frame at least every two seconds, index at the front.
std::vector<std::string> arguments(int width, int height, double fps, const std::filesystem::path& out) {
  return {"ffmpeg",
          "-hide_banner",
          "-nostdin",
          "-xerror",  // else a film without its end is no failure to it
          "-loglevel",
          "error",
          "-y",
          "-f",
          "rawvideo",
          "-pix_fmt",
          "rgb24",
          "-s",
          std::to_string(width) + "x" + std::to_string(height),
          "-framerate",
          std::to_string(fps),
          "-i",
          "pipe:0",
          "-an",
          "-vf",
          "scale=out_color_matrix=bt709:out_range=tv,format=yuv420p",
          "-c:v",
          "libx264",
          "-preset",
          "veryfast",
          "-crf",
          "18",
          "-g",
          std::to_string(std::max(1, static_cast<int>(2 * fps))),
          "-colorspace",
          "bt709",
          "-color_primaries",
          "bt709",
          "-color_trc",
          "bt709",
          "-movflags",
          "+faststart",
          "-f",
          "mp4",
          "file:" + out.string()};
}

/// Last column and row repeated, because yuv420p has even sizes only.
ImageRgb padded(const ImageRgb& image) {
  ImageRgb out(even(image.width), even(image.height));
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      std::memcpy(out.at(x, y), image.at(std::min(x, image.width - 1), std::min(y, image.height - 1)), 3);
    }
  }
  return out;
}

}  // namespace

struct Mp4Writer::Impl {
  Impl(const std::filesystem::path& path, int w, int h, double fps, std::stop_token stop)
      : width(w),
        height(h),
        file(path),
        ffmpeg(arguments(even(w), even(h), fps, file.temporary()), std::move(stop)) {}

  [[noreturn]] void fail() { file.fail("ffmpeg says: " + ffmpeg.complaint()); }

  int width, height;
  int frames = 0;
  NewFile file;
  Ffmpeg ffmpeg;  // dies before its file is removed
};

Mp4Writer::Mp4Writer(const std::filesystem::path& path, int width, int height, double fps,
                     std::stop_token stop) {
  if (width <= 0 || height <= 0 || width > 8192 || height > 8192 || !(fps >= 0.1 && fps <= 240)) {
    throw std::invalid_argument("MP4: needs 1 to 8192 pixels a side and 0.1 to 240 frames per second");
  }
  impl_ = std::make_unique<Impl>(path, width, height, fps, std::move(stop));
}

Mp4Writer::~Mp4Writer() = default;

void Mp4Writer::add(const ImageRgb& frame) {
  if (frame.width != impl_->width || frame.height != impl_->height) {
    throw std::invalid_argument("MP4: a frame of another size");
  }
  const bool is_even = frame.width % 2 == 0 && frame.height % 2 == 0;
  if (!impl_->ffmpeg.send(is_even ? frame.data : padded(frame).data)) {
    impl_->ffmpeg.wait();
    impl_->fail();
  }
  ++impl_->frames;
}

void Mp4Writer::finish() {
  if (impl_->frames == 0) throw std::runtime_error("MP4: no frames for " + impl_->file.target().string());
  if (!impl_->ffmpeg.wait()) impl_->fail();
  impl_->file.check(require_whole_mp4);
  impl_->file.commit();
}

}  // namespace flowscope
