// One registration function per command; each lives in command_<name>.cc and knows only its own options.
#pragma once

namespace CLI {
class App;
}

namespace flowscope::app {

struct Context;

void add_tasks_command(CLI::App& root, Context& context);
void add_record_command(CLI::App& root, Context& context);
void add_demos_command(CLI::App& root, Context& context);
void add_doctor_command(CLI::App& root, Context& context);
void add_train_command(CLI::App& root, Context& context);
void add_predict_command(CLI::App& root, Context& context);
void add_eval_command(CLI::App& root, Context& context);
void add_ablate_command(CLI::App& root, Context& context);
void add_policy_command(CLI::App& root, Context& context);
void add_export_command(CLI::App& root, Context& context);
void add_scene_command(CLI::App& root, Context& context);
void add_serve_command(CLI::App& root, Context& context);
void add_bench_command(CLI::App& root, Context& context);

}  // namespace flowscope::app
