#include "app/cli.h"

int main(int argc, char** argv) { return flowscope::app::run_cli(argc, argv); }
