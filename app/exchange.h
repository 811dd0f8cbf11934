// Demonstrations out of a store into other programs' formats, and back.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "app/export_scene.h"
#include "recorder/demo_store.h"

namespace flowscope {

enum class ExchangeFormat { hdf5, rlbench, npz };

struct ExportPlan {
  ExchangeFormat format = ExchangeFormat::hdf5;
  std::filesystem::path target;  ///< a file, or RLBench's root folder
  bool every_frame = false;      ///< pictures of every frame, re-drawn from the states
  bool all_variations = false;   ///< RLBench: one folder for all
  app::DemoScenes scenes;
};

/// Told after each demonstration: how many are done, and which was the last.
using ExchangeProgress = std::function<void(int done, const std::string& which)>;

/// A file appears under its name when it is whole and has been read back; RLBench's episodes appear one by
/// one, beside those that are there already. Throws BadDemo, std::invalid_argument for a demonstration that
/// the format cannot hold, or std::runtime_error / std::system_error naming the path.
void export_demos(const DemoStore& store, const std::vector<std::string>& ids, const ExportPlan& plan,
                  const ExchangeProgress& progress);

/// A file or folder that cannot be imported; what() names it and the place.
class BadImport : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct Imported {
  std::vector<std::string> ids;  ///< the new ones
  int known = 0;                 ///< left out: the same motion lies in the data folder already
};

/// Reads everything before it saves anything; what it saved goes again when a later one cannot be saved.
/// Throws BadImport, or what DemoStore::save throws.
Imported import_demos(const DemoStore& store, ExchangeFormat format, const std::filesystem::path& source,
                      const ExchangeProgress& progress);

}  // namespace flowscope
