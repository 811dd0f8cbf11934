#include <malloc.h>

#include <climits>

#include "app/cli.h"

int main(int argc, char** argv) {
  // Tensors of every step are of the same sizes: memory that was theirs is kept instead of being mapped, and
  // filled with zeros by the kernel, anew each time.
  mallopt(M_MMAP_THRESHOLD, 1 << 30);
  mallopt(M_TRIM_THRESHOLD, INT_MAX);
  return flowscope::app::run_cli(argc, argv);
}
