#include "app/demo_contents.h"

#include <algorithm>

#include "recorder/demo_file.h"
#include "recorder/sha256.h"

namespace flowscope::app {

std::vector<std::filesystem::path> demo_files_of(const std::filesystem::path& data) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(data / "demos")) {
    const auto& path = entry.path();
    if (path.extension() == ".demo" && !path.filename().string().starts_with('.')) files.push_back(path);
  }
  std::sort(files.begin(), files.end());
  return files;
}

DemoContents::DemoContents(const DemoStore& store) {
  for (const auto& file : demo_files_of(store.data())) {
    try {
      add(read_demo_bytes(file));
    } catch (const BadDemo&) {
      continue;  // what cannot be read is no reason to leave a good one out
    }
  }
}

bool DemoContents::has(const Bytes& file) const { return sha256_.contains(sha256_hex(file)); }

void DemoContents::add(const Bytes& file) { sha256_.insert(sha256_hex(file)); }

}  // namespace flowscope::app
