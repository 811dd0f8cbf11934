// How many files and sockets the program may still open.
#pragma once

namespace flowscope {

/// Descriptors that can be opened now, counted up to `enough`: by opening them for a moment, so that no limit
/// of any kind is missed.
int spare_descriptors(int enough);
/// The limit of this process (ulimit -n).
int descriptor_limit();
/// Raises or lowers the limit as far as the system lets it; returns the limit that holds then.
int set_descriptor_limit(int wanted);

}  // namespace flowscope
