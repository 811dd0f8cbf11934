// What the system lets a server have: file descriptors, and the port.
#pragma once

#include <cstdint>
#include <string>

#include "app/doctor.h"

namespace flowscope::app {

/// Of `ulimit -n`: too few let connections and pictures fail in odd ways.
DoctorCheck check_descriptors();

/// Listens for a moment. `asked`: the user named the port, so it must be free; else `serve` can take another.
DoctorCheck check_port(const std::string& host, std::uint16_t port, bool asked);

}  // namespace flowscope::app
