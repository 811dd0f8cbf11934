// The converter and the loader on weights with exactly the published names and shapes, written here as
// OpenAI's archives and other programs' exports hold them.
#include <gtest/gtest.h>
#include <torch/script.h>
#include <zlib.h>

#include <fstream>
#include <sstream>

#include "policy/clip/convert.h"
#include "policy/clip/text_branch.h"
#include "policy/clip/transformers_names.h"
#include "policy/clip/weights.h"
#include "policy/container.h"
#include "policy/policy.h"
#include "tests/support/clip_weights.h"
#include "tests/support/temporary_folder.h"

namespace flowscope {
namespace {

using std::filesystem::path;
using testing::filled;
using testing::Shapes;
using testing::Tensors;

constexpr int merges_of_clip = 48894;

// As many pairs of known symbols as CLIP has, and more behind them as in the published file.
std::string published_size_merges() {
  std::ostringstream text;
  text << "\"bpe_simple_vocab_16e6.txt#version: 0.2\n";
  int count = 0;
  for (char a = '!'; a <= '~'; ++a)
    for (char b = '!'; b <= '~'; ++b)
      for (const char* end : {"", "</w>"}) {
        text << a << " " << b << end << "\n";
        ++count;
      }
  for (char a = 'a'; count < merges_of_clip; ++a)
    for (char b = '!'; b <= '~'; ++b)
      for (char c = '!'; c <= '~' && count < merges_of_clip; ++c, ++count)
        text << a << b << " " << c << "</w>\n";
  text << "this line is behind what counts\n";
  return text.str();
}

void write_gzip(const path& file, const std::string& text) {
  const gzFile stream = gzopen(file.c_str(), "wb");
  ASSERT_EQ(gzwrite(stream, text.data(), static_cast<unsigned>(text.size())), static_cast<int>(text.size()));
  ASSERT_EQ(gzclose(stream), Z_OK);
}

void write_text(const path& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

std::string read_text(const path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

/// Safetensors in half precision, which our own writer does not store.
void write_half(const path& file, const Shapes& shapes) {
  const Tensors tensors = filled(shapes, torch::kHalf);
  std::ostringstream header;
  std::size_t offset = 0;
  for (const auto& [name, tensor] : tensors) {
    header << (offset ? "," : "{") << "\"" << name << "\":{\"dtype\":\"F16\",\"shape\":[";
    for (std::int64_t d = 0; d < tensor.dim(); ++d) header << (d ? "," : "") << tensor.size(d);
    header << "],\"data_offsets\":[" << offset << "," << offset + tensor.nbytes() << "]}";
    offset += tensor.nbytes();
  }
  header << "}";
  const std::uint64_t length = header.str().size();
  std::ofstream stream(file, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(&length), sizeof length);
  stream << header.str();
  for (const auto& [name, tensor] : tensors)
    stream.write(static_cast<const char*>(tensor.data_ptr()), static_cast<std::streamsize>(tensor.nbytes()));
}

/// A TorchScript archive whose nested modules give the dotted names.
void write_archive(const path& file, const Tensors& tensors) {
  std::map<std::string, torch::jit::Module> modules;
  modules.emplace("", torch::jit::Module("__torch__.Clip"));
  for (const auto& [name, tensor] : tensors) {
    std::string parent;
    std::istringstream parts(name);
    std::vector<std::string> steps;
    for (std::string step; std::getline(parts, step, '.');) steps.push_back(step);
    for (std::size_t i = 0; i + 1 < steps.size(); ++i) {
      const std::string child = parent + steps[i] + ".";
      if (!modules.contains(child)) {
        modules.emplace(child, torch::jit::Module("__torch__.Part" + std::to_string(modules.size())));
        modules.at(parent).register_module(steps[i], modules.at(child));
      }
      parent = child;
    }
    const bool buffer = steps.back().starts_with("running_") || steps.back().starts_with("num_");
    if (buffer)
      modules.at(parent).register_buffer(steps.back(), tensor);
    else
      modules.at(parent).register_parameter(steps.back(), tensor.detach(), false);
  }
  modules.at("").save(file.string());
}

Shapes joined(Shapes a, const Shapes& b) {
  a.insert(b.begin(), b.end());
  return a;
}

class ClipConvert : public ::testing::Test {
 protected:
  path in(const std::string& name) const { return folder_.path() / name; }
  std::string complaint(const ClipConvertOptions& options) const {
    try {
      convert_clip(options);
    } catch (const BadCheckpoint& error) {
      return error.what();
    }
    return "";
  }
  static void expect_in(const std::string& part, const std::string& text) {
    EXPECT_NE(text.find(part), std::string::npos) << "said: " << text;
  }
  /// Values of the container are those of the file that was converted.
  void expect_values(const path& clip, const Tensors& wanted, std::size_t others) const {
    const Container container = read_container(clip);
    EXPECT_EQ(container.tensors.size(), wanted.size() + others);
    for (const NamedTensor& named : container.tensors) {
      const auto found = wanted.find(named.name);
      if (found == wanted.end()) continue;
      EXPECT_EQ(named.tensor.scalar_type(), torch::kFloat32);
      EXPECT_EQ(named.tensor.sizes(), found->second.sizes()) << named.name;
      EXPECT_EQ(named.tensor.flatten()[-1].item<float>(), found->second.flatten()[-1].item<float>())
          << named.name;
    }
  }

  testing::TemporaryFolder folder_;
};

TEST_F(ClipConvert, ReadsTheImagePartOfAnOpenAiArchive) {
  const Shapes wanted = testing::trunk_shapes();
  Tensors all = filled(joined(wanted, testing::unused_shapes()), torch::kHalf);
  write_archive(in("RN50.pt"), all);
  std::erase_if(all, [&](const auto& item) { return !wanted.contains(item.first); });
  const ClipConverted converted =
      convert_clip({.image = in("RN50.pt"), .text = {}, .merges = {}, .out = in("clip")});
  expect_values(in("clip"), all, 0);
  const ClipEncoders encoders = read_clip(in("clip"));
  EXPECT_EQ(encoders.identity, converted.identity);
  EXPECT_EQ(converted.text_parameters, 0);
  EXPECT_FALSE(encoders.text || encoders.tokenizer);
  ASSERT_TRUE(encoders.image);
  const ClipTaps taps = encoders.image->forward(torch::rand({1, 3, 128, 128}));
  const std::int64_t channels[] = {64, 256, 512, 1024, 2048};
  for (int i = 0; i < 5; ++i)
    EXPECT_EQ(taps[i].sizes(), (std::vector<std::int64_t>{1, channels[i], 64 >> i, 64 >> i})) << "tap " << i;
}

TEST_F(ClipConvert, ReadsTheTextPartBesideAnotherVisualTower) {
  const Shapes wanted = testing::text_shapes();
  const Shapes vit{{"visual.class_embedding", {768}}, {"visual.conv1.weight", {768, 3, 32, 32}}};
  write_half(in("vit.safetensors"), joined(wanted, vit));
  Tensors all = filled(joined(wanted, vit));
  std::erase_if(all, [&](const auto& item) { return !wanted.contains(item.first); });
  write_gzip(in("merges.txt.gz"), published_size_merges());
  const ClipConverted converted = convert_clip(
      {.image = {}, .text = in("vit.safetensors"), .merges = in("merges.txt.gz"), .out = in("clip")});
  EXPECT_EQ(converted.image_parameters, 0);
  expect_values(in("clip"), all, 1);
  const ClipEncoders encoders = read_clip(in("clip"));
  EXPECT_FALSE(encoders.image);
  ASSERT_TRUE(encoders.text && encoders.tokenizer);
  EXPECT_EQ(encoders.tokenizer->start(), 49406);
  EXPECT_EQ(encoders.tokenizer->end(), 49407);
  EXPECT_EQ(encoders.text->vocabulary(), 49408);
  EXPECT_EQ(encoders.text->context(), 77);
  const ClipText text = encode_texts(encoders, {"push the red button"});
  EXPECT_EQ(text.hidden.size(2), 512);
  EXPECT_TRUE(torch::isfinite(text.hidden).all().item<bool>());
}

// By hand, the other way round than the program: from a published name and tensor to the library's.
Tensors transformers_names(const Tensors& published) {
  Tensors out;
  for (const auto& [published_name, tensor] : published) {
    std::string name = published_name;
    const auto replace = [&name](const std::string& from, const std::string& to) {
      if (const std::size_t at = name.find(from); at != std::string::npos) name.replace(at, from.size(), to);
    };
    if (name.find("in_proj_") != std::string::npos) {
      const std::string part = name.substr(name.rfind('_') + 1),
                        block = name.substr(22, name.find(".attn") - 22);
      const std::vector<torch::Tensor> rows = tensor.chunk(3);
      for (int i = 0; i < 3; ++i) {
        out["text_model.encoder.layers." + block + ".self_attn." + std::string(1, "qkv"[i]) + "_proj." +
            part] = rows[i].clone();
      }
      continue;
    }
    replace("transformer.resblocks", "encoder.layers");
    replace(".attn.", ".self_attn.");
    replace("ln_1", "layer_norm1");
    replace("ln_2", "layer_norm2");
    replace("c_fc", "fc1");
    replace("c_proj", "fc2");
    replace("ln_final", "final_layer_norm");
    replace("token_embedding.weight", "embeddings.token_embedding.weight");
    replace("positional_embedding", "embeddings.position_embedding.weight");
    out["text_model." + name] = tensor;
  }
  return out;
}

TEST(TransformersNames, AreBroughtToThePublishedOnes) {
  const Tensors published = testing::random_weights(testing::text_shapes(8, 2, 20, 7), 4);
  TensorsByName tensors = transformers_names(published);
  EXPECT_TRUE(tensors.contains("text_model.encoder.layers.1.self_attn.k_proj.bias"));
  add_published_names(tensors);
  for (const auto& [name, tensor] : published) {
    ASSERT_TRUE(tensors.contains(name)) << name;
    EXPECT_TRUE(torch::equal(tensors.at(name), tensor)) << name;
  }
  TensorsByName cut = transformers_names(published);
  cut.erase("text_model.encoder.layers.1.self_attn.v_proj.weight");
  EXPECT_THROW(add_published_names(cut), std::invalid_argument);
  cut["text_model.encoder.layers.1.self_attn.v_proj.weight"] = torch::zeros({8, 9});
  EXPECT_THROW(add_published_names(cut), std::invalid_argument);
}

TEST_F(ClipConvert, NamesWhatIsMissingOrOfAnotherShape) {
  Shapes shapes = testing::trunk_shapes(
      {.stem = 32, .stem_out = 64, .narrow = {64, 128, 256, 1}, .blocks = {3, 4, 6, 3}, .expansion = 4});
  write_safetensors(in("a"), filled(shapes));
  const std::string differs = complaint({.image = in("a"), .text = {}, .merges = {}, .out = in("clip")});
  expect_in(in("a").string() + ": tensor visual.layer4.0.conv1.weight is Float [1, 1024, 1, 1], not",
            differs);
  expect_in("[512, 1024, 1, 1]", differs);
  std::erase_if(shapes, [](const auto& item) { return item.first.find("layer4") != std::string::npos; });
  shapes.erase("visual.bn2.running_var");
  write_safetensors(in("a"), filled(shapes));
  const std::string missing = complaint({.image = in("a"), .text = {}, .merges = {}, .out = in("clip")});
  expect_in("tensor visual.bn2.running_var is missing", missing);
  expect_in("more", missing);
  EXPECT_FALSE(std::filesystem::exists(in("clip")));
}

TEST_F(ClipConvert, SaysWhenAFileIsCutOrAnotherKind) {
  const auto said = [&](const std::string& name) {
    return complaint({.image = in(name), .text = {}, .merges = {}, .out = in("clip")});
  };
  expect_in("cannot be opened", said("none"));
  write_text(in("noise"), "this is no file of weights at all");
  expect_in(in("noise").string() + ": ", said("noise"));
  write_archive(in("whole.pt"), filled({{"visual.conv1.weight", {32, 3, 3, 3}}}));
  expect_in("is missing", said("whole.pt"));
  const std::string whole = read_text(in("whole.pt"));
  write_text(in("cut.pt"), whole.substr(0, whole.size() / 2));
  expect_in(in("cut.pt").string() + ": is no whole TorchScript archive", said("cut.pt"));
  write_safetensors(in("whole"), filled({{"visual.conv1.weight", {32, 3, 3, 3}}}));
  const std::string plain = read_text(in("whole"));
  write_text(in("cut"), plain.substr(0, plain.size() - 1));
  expect_in(in("cut").string() + ": ", said("cut"));
}

TEST_F(ClipConvert, SaysWhatIsWrongWithTheMerges) {
  write_safetensors(in("a"), filled({{"positional_embedding", {77, 512}}}));
  const auto said = [&](const std::string& name) {
    return complaint({.image = {}, .text = in("a"), .merges = in(name), .out = in("clip")});
  };
  expect_in("cannot be opened", said("none"));
  write_text(in("few"), "#version: 0.2\nl o\nlo w\n");
  expect_in("vocabulary of 516, not 49408", said("few"));
  write_text(in("prose"), "l o\nonce upon a time\n");
  expect_in(in("prose").string() + ": merges: line 2", said("prose"));
  write_text(in("long"), std::string(5 << 20, 'x'));
  expect_in("is no merges file", said("long"));
  write_gzip(in("whole.gz"), published_size_merges());
  write_text(in("cut.gz"), read_text(in("whole.gz")).substr(0, 20000));
  expect_in("is cut or damaged", said("cut.gz"));
}

TEST_F(ClipConvert, ReadsTheMergesThatClipUsesPackedOrPlain) {
  const std::string merges = published_size_merges();
  write_gzip(in("packed.gz"), merges);
  write_text(in("plain.txt"), merges);
  // Without the version line and without anything behind.
  write_text(in("bare.txt"),
             merges.substr(merges.find('\n') + 1, merges.rfind("this") - merges.find('\n') - 1));
  for (const char* name : {"packed.gz", "plain.txt", "bare.txt"}) {
    const std::string text = read_merges(in(name));
    EXPECT_EQ(text.find("this line"), std::string::npos) << name;
    EXPECT_EQ(ClipTokenizer(text).vocabulary(), 49408) << name;
  }
}

TEST_F(ClipConvert, RefusesOptionsThatDoNotFitTogether) {
  EXPECT_THROW(convert_clip({}), std::invalid_argument);
  EXPECT_THROW(convert_clip({.image = {}, .text = in("a"), .merges = {}, .out = in("b")}),
               std::invalid_argument);
  EXPECT_THROW(convert_clip({.image = in("a"), .text = {}, .merges = {}, .out = {}}), std::invalid_argument);
}

TEST_F(ClipConvert, LoadsNothingButItsOwnContainer) {
  write_container(in("policy"), {.text = {{"config", "{}"}}, .tensors = {{"weight", torch::ones({2})}}});
  try {
    read_clip(in("policy"));
    ADD_FAILURE() << "accepted a policy";
  } catch (const BadCheckpoint& error) {
    expect_in(in("policy").string() + ": text \"kind\"", error.what());
  }
  const Container half{.text = {{"kind", "clip/1"}, {"identity", "x"}},
                       .tensors = {{"visual.conv1.weight", torch::ones({32, 3, 3, 3})}}};
  write_container(in("half"), half);
  try {
    read_clip(in("half"));
    ADD_FAILURE() << "accepted half a trunk";
  } catch (const BadCheckpoint& error) {
    expect_in("visual.bn1.weight is missing", error.what());
  }
}

TEST_F(ClipConvert, GivesOtherValuesAnotherIdentity) {
  Tensors tensors = filled(testing::trunk_shapes());
  const std::string first = write_clip(in("a"), tensors, {}, "");
  EXPECT_EQ(write_clip(in("b"), tensors, {}, ""), first);
  tensors["visual.layer4.2.bn3.bias"][7] += 1;
  EXPECT_NE(write_clip(in("b"), tensors, {}, ""), first);
}

}  // namespace
}  // namespace flowscope
