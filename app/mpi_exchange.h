// Training over several processes and machines: mpirun -n N flowscope train …
#pragma once

#include <memory>

#include "policy/exchange.h"

namespace flowscope {

/// Whether this process was started by mpirun (or srun with PMIx) beside others.
bool started_by_mpi();

/// The processes that mpirun started together; ends MPI when destroyed, which waits for the others. One per
/// program, on the thread that made it. Sums go to rank 0 and back, so that every rank has the same bits.
/// Throws std::runtime_error.
class MpiExchange : public GradientExchange {
 public:
  MpiExchange();
  ~MpiExchange() override;
  MpiExchange(const MpiExchange&) = delete;
  MpiExchange& operator=(const MpiExchange&) = delete;

  int rank() const override { return rank_; }
  int size() const override { return size_; }
  void sum(float* numbers, std::size_t count) override;
  void broadcast(void* bytes, std::size_t count) override;
  /// Ends all processes with this exit code: what a rank that fails does, for the others would wait for it.
  [[noreturn]] void abort(int exit_code);

 private:
  int rank_ = 0, size_ = 1;
};

}  // namespace flowscope
