#include "render/descriptors.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <limits>
#include <vector>

namespace flowscope {

namespace {

rlimit limits() {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  return limit;
}

int as_int(rlim_t value) {
  return static_cast<int>(std::min<rlim_t>(value, std::numeric_limits<int>::max()));
}

}  // namespace

int spare_descriptors(int enough) {
  std::vector<int> opened;
  while (static_cast<int>(opened.size()) < enough) {
    const int file = open("/dev/null", O_RDONLY | O_CLOEXEC);
    if (file < 0) break;
    opened.push_back(file);
  }
  for (const int file : opened) close(file);
  return static_cast<int>(opened.size());
}

int descriptor_limit() { return as_int(limits().rlim_cur); }

int set_descriptor_limit(int wanted) {
  rlimit limit = limits();
  limit.rlim_cur = std::min(static_cast<rlim_t>(wanted), limit.rlim_max);
  setrlimit(RLIMIT_NOFILE, &limit);
  return descriptor_limit();
}

}  // namespace flowscope
