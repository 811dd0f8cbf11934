// The thread that owns every torch object: one optimiser step, then the waiting jobs, then the next step.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
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

/// Trains in the background, predicts in between. Public methods: any thread.
class PolicyLoop {
 public:
  /// Weights trained here are kept in `file` (data/policies/live.flow). `on_report` hears of progress a few
  /// times a second.
  PolicyLoop(const DemoStore& store, std::filesystem::path file,
             std::function<void(const web::TrainReport&)> on_report);
  ~PolicyLoop();

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
  /// not fit it.
  std::future<std::vector<FlowTrace>> predict(PolicyInput input, PredictOptions options, int samples = 1);
  web::PolicyStatus status() const;

 private:
  struct Room {
    std::unique_ptr<Policy> loaded;
    std::unique_ptr<Trainer> trainer;
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
  JobQueue<Room> queue_;
  std::jthread thread_;
};

}  // namespace flowscope
