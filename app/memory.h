// What a long-running server asks of the C library's allocator.
#pragma once

namespace flowscope {

/// Few arenas for many threads, and large pictures outside of them: what one thread has freed another can
/// use, and a picture's memory goes back at once. Before the first thread.
void limit_arenas();

/// Hands memory that is free at the moment back to the operating system; takes some milliseconds. Any thread.
void give_back_memory();

}  // namespace flowscope
