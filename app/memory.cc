#include "app/memory.h"

#include <malloc.h>

namespace flowscope {

void limit_arenas() {
  mallopt(M_ARENA_MAX, 2);
  mallopt(M_MMAP_THRESHOLD, 32 << 20);  // above what a step of training takes in one piece
}

void give_back_memory() { malloc_trim(0); }

}  // namespace flowscope
