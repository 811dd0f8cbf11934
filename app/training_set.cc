#include "app/training_set.h"

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>

namespace flowscope {

bool held_out(std::size_t position) { return position % 20 == 9; }

TrainingChoice choose_training(const std::vector<DemoInfo>& stored, const std::vector<std::string>& tasks,
                               bool unfinished) {
  TrainingChoice choice;
  std::map<std::string, std::set<std::string>> tasks_by_robot;
  for (const DemoInfo& info : stored) {
    if (!tasks.empty() && std::ranges::find(tasks, info.task) == tasks.end()) continue;
    if (info.unfinished() && !unfinished) {
      ++choice.unfinished;
      continue;
    }
    choice.demos.push_back(info);
    if (!info.origin.robot.empty()) tasks_by_robot[info.origin.robot].insert(info.task);
  }
  if (tasks_by_robot.size() > 1) {
    std::string text = "a policy learns one robot, and these are demonstrations of several:";
    for (const auto& [robot, names] : tasks_by_robot) {
      text += " " + robot + " (";
      for (const std::string& name : names) text += (name == *names.begin() ? "" : ", ") + name;
      text += ")";
    }
    throw std::invalid_argument(text + "; choose tasks of one of them");
  }
  if (!tasks_by_robot.empty()) choice.robot = tasks_by_robot.begin()->first;
  return choice;
}

std::string TrainingIntake::add(Trainer& trainer, const std::string& id) {
  try {
    const Demo demo = store_.load(id);
    if (const std::string problem = judge_.find_problem(id, demo); !problem.empty())
      return store_.path(id).string() + ": " + problem;
    std::size_t& position = taken_[demo.info.task];
    trainer.add(demo, held_out(position));
    ++position;
    return "";
  } catch (const BadDemo& error) {
    return error.what();
  } catch (const std::out_of_range& error) {  // deleted meanwhile
    return error.what();
  } catch (const std::invalid_argument& error) {
    return store_.path(id).string() + ": " + error.what();
  }
}

std::vector<DemoProblem> TrainingIntake::add_all(Trainer& trainer, const std::vector<DemoInfo>& demos) {
  std::vector<DemoProblem> left_out;
  for (const DemoInfo& info : demos) {
    if (std::string problem = add(trainer, info.id); !problem.empty())
      left_out.push_back({info.id, std::move(problem)});
  }
  return left_out;
}

void TrainingIntake::remove(Trainer& trainer, const std::string& id) {
  judge_.forget(id);
  trainer.remove(id);
}

}  // namespace flowscope
