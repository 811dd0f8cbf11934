#include "recorder/mesh/gltf_draco.h"

#include <draco/compression/decode.h>

#include <algorithm>

#include "recorder/mesh/gltf_file.h"

namespace flowscope {

DracoPrimitive decode_draco(std::span<const std::uint8_t> bytes,
                            const std::map<std::string, std::uint32_t>& ids) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok())
    throw BadGltf("has data that Draco can not decode: " + decoded.status().error_msg_string());
  const draco::Mesh& mesh = *decoded.value();
  DracoPrimitive primitive;
  for (draco::FaceIndex face(0); face < mesh.num_faces(); ++face)
    for (const draco::PointIndex& corner : mesh.face(face)) primitive.indices.push_back(corner.value());
  for (const auto& [name, id] : ids) {
    const draco::PointAttribute* attribute = mesh.GetAttributeByUniqueId(id);
    if (attribute == nullptr) throw BadGltf("names an attribute that its Draco data lack");
    auto& values = primitive.attributes[name];
    values.resize(mesh.num_points(), {0, 0, 0, 1});
    const auto width = static_cast<std::size_t>(attribute->num_components());
    primitive.widths[name] = width;
    for (draco::PointIndex point(0); point < mesh.num_points(); ++point) {
      std::array<float, 4> value{0, 0, 0, 1};
      if (!attribute->ConvertValue<float>(attribute->mapped_index(point),
                                          static_cast<std::int8_t>(std::min<std::size_t>(width, 4)),
                                          value.data()))
        throw BadGltf("has Draco data of an unknown type");
      for (std::size_t k = width; k < 4; ++k) value[k] = k == 3 ? 1 : 0;
      values[point.value()] = value;
    }
  }
  return primitive;
}

}  // namespace flowscope
