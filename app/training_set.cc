#include "app/training_set.h"

#include <cctype>

namespace flowscope {

bool held_out(const std::string& demo_id) {
  std::size_t begin = demo_id.size();
  while (begin > 0 && std::isdigit(static_cast<unsigned char>(demo_id[begin - 1]))) --begin;
  if (begin == demo_id.size()) return false;
  unsigned long long number = 0;
  for (std::size_t i = begin; i < demo_id.size(); ++i) number = number * 10 + (demo_id[i] - '0');
  return number % 20 == 10;
}

}  // namespace flowscope
