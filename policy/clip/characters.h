// The classes of characters that CLIP's word splitter asks for, without a locale: the same on every machine.
// Source: Unicode 14.0 character database (general categories L and N, simple lower-case mappings).
#pragma once

namespace flowscope {

bool is_letter(char32_t c);  ///< general category L
bool is_number(char32_t c);  ///< general category N
bool is_space(char32_t c);   ///< what Unicode and ASCII's separators count as white space
char32_t to_lower(char32_t c);

}  // namespace flowscope
