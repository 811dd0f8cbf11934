// The thread that owns every torch object: a slice of a prediction or one optimiser step, then the waiting
// jobs, and so on.
#pragma once

#include <atomic>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "app/job_queue.h"
#include "app/latest.h"
#include "app/training_set.h"
#include "policy/policy.h"
#include "policy/trainer.h"
#include "recorder/demo_store.h"
#include "web/backend.h"

namespace flowscope {

/// Trains in the background, predicts in between. Predictions go on in slices of some 20 ms, in turns the
/// oldest and the one with the fewest steps left, so that short ones pass long ones; training waits for them.
/// Public methods: any thread.
class PolicyLoop {
 public:
  /// Weights trained here are kept in `file` (data/policies/live.flow). `on_report` hears of progress a few
  /// times a second.
  PolicyLoop(const DemoStore& store, std::filesystem::path file,
             std::function<void(const web::TrainReport&)> on_report);
  ~PolicyLoop();

  /// Ends training, which is kept, and predictions, whose callers get web::ApiError 503; so does every call
  /// from now on. Does not wait.
  void leave();

  /// Loads a checkpoint to predict with. Throws BadCheckpoint through the future; what was loaded before
  /// stays.
  std::future<void> load(std::filesystem::path file);
  /// Starts afresh, or with `resume` goes on with the weights in use. Throws web::ApiError when there is
  /// nothing to learn from, or nothing to go on with, or when there is more than one robot.
  std::future<web::TrainReport> start(web::TrainRequest request);
  std::future<web::TrainReport> stop();
  const std::filesystem::path& file() const { return file_; }
  web::TrainReport report() const;

  /// A demonstration was saved or removed: the next batch knows it.
  void demo_saved(const std::string& id);
  void demo_removed(const std::string& id);

  /// Policy::predict_samples. Throws web::ApiError: 409 when there is no policy yet, 400 for options that do
  /// not fit it, 409 when it was stopped. What `options` points to must live until the answer is there.
  std::future<std::vector<FlowTrace>> predict(PolicyInput input, PredictOptions options, int samples = 1,
                                              std::stop_token stop = {});
  web::PolicyStatus status() const;

 private:
  using Answer = std::promise<std::vector<FlowTrace>>;
  /// A prediction under way.
  struct Asked {
    std::shared_ptr<Policy> policy;  ///< goes on with the weights that it began with
    std::unique_ptr<Prediction> prediction;
    std::shared_ptr<Answer> answer;
    std::stop_token stop;
    bool in_training = false;
  };
  struct Room {
    std::shared_ptr<Policy> loaded;
    std::shared_ptr<Trainer> trainer;  ///< while it trains, and after that only if it could not be saved
    std::deque<Asked> asked;           ///< the oldest first
    std::uint64_t slices = 0;
    std::filesystem::path file;  ///< of `loaded`
    bool training = false;
    std::vector<std::string> tasks;
    bool unfinished = false;               ///< learns from those that do not succeed, too
    std::optional<TrainingIntake> intake;  ///< of `trainer`
    std::filesystem::path saved;           ///< where the trainer's weights were saved last; empty: nowhere
    std::int64_t until_step = 0;           ///< 0: no limit
    double until_minutes = 0;
    double saved_minutes = 0, validated_minutes = 0;
    web::TrainReport report;
  };
  /// Throws web::ApiError.
  TrainingChoice choice_for(const web::TrainRequest& request, std::vector<DemoProblem>& left_out) const;
  void begin(Room& room, const web::TrainRequest& request);
  void train_step(Room& room);
  void take_up(Room& room, Asked asked, const PolicyInput& input, const PredictOptions& options, int samples);
  void predict_on(Room& room);
  void interrupt_step();
  std::stop_token step_stop();
  /// The weights that were trained and kept go on from their file; all that only training needs is let go.
  void let_go(Room& room);
  void add_demo(Room& room, const std::string& id);
  void take_demos(Room& room, const TrainingChoice& choice);
  void save_first(Room& room);
  void save(Room& room);
  static bool predicts_with_trainer(const Room& room);
  void finish(Room& room, const std::string& error);
  void publish(Room& room);

  const DemoStore& store_;
  const std::filesystem::path file_;
  std::function<void(const web::TrainReport&)> on_report_;
  Latest<web::TrainReport> report_;
  Latest<web::PolicyStatus> status_;
  std::atomic<bool> leaving_{false};
  std::mutex step_mutex_;
  std::stop_source step_stop_;  ///< of the optimiser step or validation in progress
  JobQueue<Room> queue_;
  std::jthread thread_;
};

}  // namespace flowscope
