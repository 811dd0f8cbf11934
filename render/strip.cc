#include "render/strip.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace flowscope {

namespace {

constexpr int font = cv::FONT_HERSHEY_DUPLEX;
constexpr int largest_side = 16384;

struct Row {
  std::size_t first, end;
  int width;  ///< pixels, without the outer gaps
};

cv::Mat as_mat(const ImageRgb& image) {
  return {image.height, image.width, CV_8UC3, const_cast<std::uint8_t*>(image.data.data())};
}

int scaled_width(const ImageRgb& image, int height) {
  return std::max(1, static_cast<int>(static_cast<long>(image.width) * height / image.height));
}

void check(const std::vector<StripPanel>& panels, const StripStyle& style) {
  if (panels.empty()) throw std::invalid_argument("strip: no pictures");
  if (style.height < 16 || style.height > 4096 || style.gap < 0 || style.gap > 256 || style.columns < 0) {
    throw std::invalid_argument("strip: height must be 16 to 4096 pixels, the gap 0 to 256");
  }
  for (const StripPanel& panel : panels) {
    const ImageRgb& image = panel.image;
    if (image.width <= 0 || image.height <= 0 ||
        image.data.size() != ImageRgb(image.width, image.height).data.size()) {
      throw std::invalid_argument("strip: picture '" + panel.caption + "' is empty");
    }
  }
}

std::vector<Row> arrange(const std::vector<StripPanel>& panels, const StripStyle& style) {
  const std::size_t columns = style.columns > 0 ? static_cast<std::size_t>(style.columns) : panels.size();
  std::vector<Row> rows;
  for (std::size_t first = 0; first < panels.size(); first += columns) {
    Row row{first, std::min(first + columns, panels.size()), 0};
    for (std::size_t i = row.first; i < row.end; ++i) {
      row.width += scaled_width(panels[i].image, style.height) + (i > row.first ? style.gap : 0);
    }
    rows.push_back(row);
  }
  return rows;
}

void write_caption(cv::Mat& canvas, const std::string& text, const cv::Rect& place) {
  if (text.empty()) return;
  int baseline = 0;
  double scale = 0.024 * place.height;
  const cv::Size natural = cv::getTextSize(text, font, scale, 1, &baseline);
  scale *= std::min(1.0, static_cast<double>(place.width) / natural.width);
  const cv::Size size = cv::getTextSize(text, font, scale, 1, &baseline);
  const cv::Point start(place.x + (place.width - size.width) / 2, place.y + (place.height + size.height) / 2);
  cv::putText(canvas, text, start, font, scale, {30, 32, 40}, 1, cv::LINE_AA);
}

}  // namespace

ImageRgb compose_strip(const std::vector<StripPanel>& panels, const StripStyle& style) {
  check(panels, style);
  const bool captions =
      std::any_of(panels.begin(), panels.end(), [](const auto& p) { return !p.caption.empty(); });
  const int caption_height = captions ? std::clamp(style.height / 12, 20, 64) : 0;
  const int row_height = style.height + caption_height + style.gap;
  const std::vector<Row> rows = arrange(panels, style);
  const auto widest =
      std::max_element(rows.begin(), rows.end(), [](auto& a, auto& b) { return a.width < b.width; });
  const long width = widest->width + 2L * style.gap;
  const long height = static_cast<long>(rows.size()) * row_height + style.gap;
  if (width > largest_side || height > largest_side) {
    throw std::invalid_argument("strip: " + std::to_string(width) + "x" + std::to_string(height) +
                                " pixels are too many; use fewer pictures, a smaller height or more rows");
  }
  ImageRgb strip(static_cast<int>(width), static_cast<int>(height));
  cv::Mat canvas = as_mat(strip);
  canvas.setTo(cv::Scalar(255, 255, 255));
  int y = style.gap;
  for (const Row& row : rows) {
    int x = style.gap;
    for (std::size_t i = row.first; i < row.end; ++i) {
      const cv::Mat picture = as_mat(panels[i].image);
      const cv::Rect place(x, y, scaled_width(panels[i].image, style.height), style.height);
      cv::Mat target = canvas(place);
      cv::resize(picture, target, place.size(), 0, 0,
                 picture.rows > style.height ? cv::INTER_AREA : cv::INTER_CUBIC);
      write_caption(canvas, panels[i].caption, {x, y + style.height, place.width, caption_height});
      x += place.width + style.gap;
    }
    y += row_height;
  }
  return strip;
}

}  // namespace flowscope
