#include "app/job_board.h"

#include <algorithm>

#include "render/new_file.h"

namespace flowscope {

using web::ApiError;
using web::JobStatus;

namespace {

bool over(const JobStatus& status) { return status.state != "queued" && status.state != "running"; }

void cancelled(JobStatus& status) {
  status.state = "cancelled";
  status.message = "cancelled";
}

}  // namespace

JobBoard::JobBoard(std::function<void(const JobStatus&)> on_change) : on_change_(std::move(on_change)) {
  for (Lane& lane : lanes_)
    for (int i = 0; i < lane.limits.workers; ++i) lane.threads.emplace_back([this, &lane] { serve(lane); });
}

JobBoard::~JobBoard() { shut_down(); }

bool JobBoard::Handle::update(const std::function<void(JobStatus&)>& change) {
  const std::lock_guard telling(board_.telling_);
  return board_.change(job_, change);
}

JobBoard::JobPtr JobBoard::find(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  for (const JobPtr& job : jobs_)
    if (job->status.id == id) return job;
  throw ApiError(404, "not_found",
                 "there is no job " + id + " (of those that ended only the newest " +
                     std::to_string(ended_kept) + " are kept)");
}

bool JobBoard::change(Job& job, const std::function<void(JobStatus&)>& change) {
  JobStatus now;
  {
    const std::lock_guard lock(mutex_);
    if (over(job.status)) return false;
    change(job.status);
    now = job.status;
  }
  on_change_(now);
  return true;
}

std::string JobBoard::start(JobLane which, const std::string& kind, std::function<void(Handle&)> work) {
  Lane& lane = lanes_[static_cast<std::size_t>(which)];
  const auto job = std::make_shared<Job>();
  job->work = std::move(work);
  job->lane = which;
  const std::lock_guard telling(telling_);
  {
    const std::lock_guard lock(mutex_);
    if (closed_) throw ApiError(503, "shutting_down", "flowscope is shutting down");
    const auto workers = static_cast<std::size_t>(lane.limits.workers);
    if (lane.waiting.size() + static_cast<std::size_t>(lane.running) >= workers + lane.limits.waiting) {
      throw ApiError(429, "too_many_jobs",
                     std::to_string(workers) + " of the " + lane.what + " run and " +
                         std::to_string(lane.limits.waiting) +
                         " wait already; try again when one of them has ended");
    }
    job->status.id = "job-" + std::to_string(next_++);
    job->status.kind = kind;
    job->status.state = "queued";
    job->status.message = "waiting for its turn";
    jobs_.push_back(job);
    lane.waiting.push_back(job);
  }
  const std::string id = job->status.id;
  change(*job, [](JobStatus&) {});
  lane.ready.notify_one();
  return id;
}

void JobBoard::serve(Lane& lane) {
  for (;;) {
    JobPtr job;
    {
      std::unique_lock lock(mutex_);
      lane.ready.wait(lock, [&] { return closed_ || !lane.waiting.empty(); });
      if (lane.waiting.empty()) return;
      job = std::move(lane.waiting.front());
      lane.waiting.pop_front();
      ++lane.running;
    }
    run(*job);
    job->work = nullptr;  // with all that it holds
    const std::lock_guard lock(mutex_);
    --lane.running;
    forget_old();
  }
}

void JobBoard::run(Job& job) {
  Handle handle(*this, job);
  const auto failed = [&](const std::string& code, const std::string& what, const std::string& where) {
    handle.update([&](JobStatus& s) {
      if (handle.stop().stop_requested()) return cancelled(s);
      s.state = "failed";
      s.error_code = code;
      s.error = what;
      s.where = where;
    });
  };
  try {
    const bool wanted = handle.update([](JobStatus& s) {
      s.state = "running";
      s.message.clear();
    });
    if (!wanted) return;
    job.work(handle);
    handle.update([&](JobStatus& s) {
      // What was done and kept before the wish to stop came is done.
      if (handle.stop().stop_requested() && !s.success) return cancelled(s);
      s.state = "done";
      s.progress = 1;
    });
  } catch (const ApiError& error) {
    failed(error.code, error.what(), error.where);
  } catch (const std::exception& error) {
    failed(is_full_disk(error) ? "disk_full" : "failed", error.what(), "");
  }
}

void JobBoard::forget_old() {
  auto ended = static_cast<std::size_t>(
      std::ranges::count_if(jobs_, [](const JobPtr& job) { return over(job->status); }));
  std::erase_if(jobs_, [&](const JobPtr& job) {
    if (ended <= ended_kept || !over(job->status)) return false;
    --ended;
    return true;
  });
}

std::vector<JobStatus> JobBoard::all() const {
  const std::lock_guard lock(mutex_);
  std::vector<JobStatus> result;
  for (const JobPtr& job : jobs_) result.push_back(job->status);
  return result;
}

JobStatus JobBoard::get(const std::string& id) const {
  const JobPtr job = find(id);
  const std::lock_guard lock(mutex_);
  return job->status;
}

bool JobBoard::goes_on(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  return std::ranges::any_of(jobs_,
                             [&](const JobPtr& job) { return job->status.id == id && !over(job->status); });
}

void JobBoard::cancel(const std::string& id) {
  find(id);
  cancel_if_known(id);
}

void JobBoard::cancel_if_known(const std::string& id) {
  const std::lock_guard telling(telling_);
  JobPtr job;
  bool waited = false;
  {
    const std::lock_guard lock(mutex_);
    const auto found = std::ranges::find_if(jobs_, [&](const JobPtr& j) { return j->status.id == id; });
    if (found == jobs_.end()) return;
    job = *found;
    for (Lane& lane : lanes_) waited = std::erase(lane.waiting, job) > 0 || waited;
  }
  job->stop.request_stop();
  if (waited) job->work = nullptr;
  if (!waited && job->lane != JobLane::exports) return;
  change(*job, cancelled);
  const std::lock_guard lock(mutex_);
  forget_old();
}

void JobBoard::close() {
  std::vector<std::string> ids;
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    for (const JobPtr& job : jobs_)
      if (!over(job->status)) ids.push_back(job->status.id);
  }
  for (const std::string& id : ids) cancel_if_known(id);
  for (Lane& lane : lanes_) lane.ready.notify_all();
}

void JobBoard::shut_down() {
  close();
  for (Lane& lane : lanes_)
    for (std::thread& thread : lane.threads)
      if (thread.joinable()) thread.join();
}

}  // namespace flowscope
