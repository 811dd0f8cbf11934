// The simulator's and the renderer's part of an export: pictures of any frame, the scene's text, what is an
// object.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "app/demo_tasks.h"
#include "recorder/formats/export_source.h"

namespace flowscope {

struct ExportPictures {
  bool every_frame = false;  ///< else only those that the demonstration has
  bool overhead = false;  ///< a fifth camera that looks down on the table: RLBench's readers count its files
};

/// Opens the scene of each demonstration and keeps the last one. One thread: it may own a renderer.
class ExportScenes {
 public:
  ExportScenes(app::DemoScenes scenes, ExportPictures pictures);
  ~ExportScenes();

  /// Where the task is not installed, or the scene not there as it was, all stays empty that would come from
  /// it; if pictures have to be taken there, throws std::invalid_argument that says why.
  ExportSource source_for(const Demo& demo);
  /// Why the last source is empty, or nothing.
  const std::string& left_out() const { return left_out_; }

 private:
  struct Scene;
  app::DemoScenes scenes_;
  ExportPictures pictures_;
  std::shared_ptr<Scene> scene_;
  std::string left_out_;
};

}  // namespace flowscope
