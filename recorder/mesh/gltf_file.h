// A glTF 2.0 file taken apart: its JSON, its buffers and the numbers in them.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace flowscope {

/// What is wrong, without the file's name.
class BadGltf : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Everything throws BadGltf or nlohmann's exceptions for what the file gets wrong.
class GltfFile {
 public:
  /// A .gltf, or a .glb by its first bytes; buffers inside it or beside it, never anywhere else.
  explicit GltfFile(const std::filesystem::path& file);

  const nlohmann::json& root() const { return root_; }
  bool is_version_2() const;
  /// An entry of one of the file's lists ("meshes"); throws for one that does not exist.
  const nlohmann::json& entry(const char* list, std::size_t index) const;
  std::span<const std::uint8_t> view(std::size_t buffer_view) const;
  /// An accessor's elements as numbers, whatever they are stored as (normalized ones from -1 or 0 to 1); what
  /// an element lacks is 0, the fourth 1. `width` is how many the file has of each.
  std::vector<std::array<float, 4>> vectors(std::size_t accessor, std::size_t& width) const;
  std::vector<std::uint32_t> indices(std::size_t accessor) const;
  std::filesystem::path folder() const { return folder_; }

 private:
  struct Layout;
  Layout layout_of(const nlohmann::json& holder, int component, std::size_t width, std::size_t count) const;
  void open_buffers(std::vector<std::uint8_t> binary);

  std::filesystem::path folder_;
  nlohmann::json root_;
  std::vector<std::vector<std::uint8_t>> buffers_;
};

/// The bytes of a data: URI in base64.
std::vector<std::uint8_t> bytes_of_data_uri(const std::string& uri);

}  // namespace flowscope
