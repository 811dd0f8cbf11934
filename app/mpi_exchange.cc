#include "app/mpi_exchange.h"

// The C++ bindings were taken out of the standard and would need another library.
#define OMPI_SKIP_MPICXX 1
#define MPICH_SKIP_MPICXX 1
#include <mpi.h>

#include <algorithm>
#include <cstdlib>
#include <stdexcept>
#include <string>

namespace flowscope {
namespace {

constexpr std::size_t largest_message = std::size_t{1} << 28;  // MPI counts with int

void check(int code, const char* what) {
  if (code == MPI_SUCCESS) return;
  char text[MPI_MAX_ERROR_STRING] = {};
  int length = 0;
  MPI_Error_string(code, text, &length);
  throw std::runtime_error(std::string("MPI: ") + what + ": " + std::string(text, text + length));
}

}  // namespace

bool started_by_mpi() {
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK"})
    if (std::getenv(name)) return true;
  return false;
}

MpiExchange::MpiExchange() {
  int given = 0;
  if (MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &given) != MPI_SUCCESS)
    throw std::runtime_error("MPI: the processes could not be joined");
  MPI_Comm_set_errhandler(MPI_COMM_WORLD, MPI_ERRORS_RETURN);
  check(MPI_Comm_rank(MPI_COMM_WORLD, &rank_), "rank");
  check(MPI_Comm_size(MPI_COMM_WORLD, &size_), "size");
}

MpiExchange::~MpiExchange() { MPI_Finalize(); }

void MpiExchange::sum(float* numbers, std::size_t count) {
  for (std::size_t at = 0; at < count; at += largest_message) {
    const int part = static_cast<int>(std::min(largest_message, count - at));
    // Not MPI_Allreduce: it may add in another order on each rank.
    check(MPI_Reduce(rank_ == 0 ? MPI_IN_PLACE : numbers + at, rank_ == 0 ? numbers + at : nullptr, part,
                     MPI_FLOAT, MPI_SUM, 0, MPI_COMM_WORLD),
          "adding up gradients");
    check(MPI_Bcast(numbers + at, part, MPI_FLOAT, 0, MPI_COMM_WORLD), "sending back gradients");
  }
}

void MpiExchange::broadcast(void* bytes, std::size_t count) {
  for (std::size_t at = 0; at < count; at += largest_message) {
    const int part = static_cast<int>(std::min(largest_message, count - at));
    check(MPI_Bcast(static_cast<char*>(bytes) + at, part, MPI_BYTE, 0, MPI_COMM_WORLD), "sending");
  }
}

void MpiExchange::abort(int exit_code) {
  MPI_Abort(MPI_COMM_WORLD, exit_code);
  std::abort();  // MPI_Abort does not return, but its header does not say so
}

}  // namespace flowscope
