#include "app/job_board.h"

#include "render/new_file.h"

namespace flowscope {

using web::ApiError;
using web::JobStatus;

JobBoard::JobBoard(std::function<void(const JobStatus&)> on_change) : on_change_(std::move(on_change)) {}

JobBoard::~JobBoard() { shut_down(); }

void JobBoard::Handle::update(const std::function<void(JobStatus&)>& change) { board_.change(id_, change); }

JobBoard::Job& JobBoard::find(const std::string& id) {
  for (auto& job : jobs_)
    if (job->status.id == id) return *job;
  throw ApiError(404, "not_found", "there is no job " + id);
}

void JobBoard::change(const std::string& id, const std::function<void(JobStatus&)>& change) {
  JobStatus now;
  {
    std::lock_guard lock(mutex_);
    Job& job = find(id);
    change(job.status);
    now = job.status;
  }
  on_change_(now);
}

std::string JobBoard::start(const std::string& kind, std::function<void(Handle&)> work) {
  std::string id;
  {
    std::lock_guard lock(mutex_);
    if (closed_) throw ApiError(503, "shutting_down", "flowscope is shutting down");
    id = "job-" + std::to_string(next_++);
    auto job = std::make_unique<Job>();
    job->status.id = id;
    job->status.kind = kind;
    job->status.state = "queued";
    jobs_.push_back(std::move(job));
  }
  auto body = [this, id, work = std::move(work)](std::stop_token stop) {
    Handle handle(*this, id, stop);
    try {
      handle.update([](JobStatus& s) { s.state = "running"; });
      work(handle);
      handle.update([&](JobStatus& s) {
        if (s.state == "running") s.state = stop.stop_requested() ? "cancelled" : "done";
        if (s.state == "done") s.progress = 1;
      });
    } catch (const ApiError& error) {
      handle.update([&](JobStatus& s) {
        s.state = stop.stop_requested() ? "cancelled" : "failed";
        s.error_code = error.code;
        s.error = error.what();
        s.where = error.where;
      });
    } catch (const std::exception& error) {
      handle.update([&](JobStatus& s) {
        s.state = stop.stop_requested() ? "cancelled" : "failed";
        s.error_code = is_full_disk(error) ? "disk_full" : "failed";
        s.error = error.what();
      });
    }
  };
  std::lock_guard lock(mutex_);
  find(id).thread = std::jthread(std::move(body));
  return id;
}

std::vector<JobStatus> JobBoard::all() const {
  std::lock_guard lock(mutex_);
  std::vector<JobStatus> result;
  for (const auto& job : jobs_) result.push_back(job->status);
  return result;
}

JobStatus JobBoard::get(const std::string& id) const {
  std::lock_guard lock(mutex_);
  return const_cast<JobBoard*>(this)->find(id).status;
}

void JobBoard::cancel(const std::string& id) {
  std::lock_guard lock(mutex_);
  find(id).thread.request_stop();
}

void JobBoard::shut_down() {
  std::vector<std::jthread> threads;
  {
    std::lock_guard lock(mutex_);
    closed_ = true;
    for (auto& job : jobs_) {
      job->thread.request_stop();
      threads.push_back(std::move(job->thread));
    }
  }
  threads.clear();  // joins, with the mutex free so that the jobs can report their end
}

}  // namespace flowscope
