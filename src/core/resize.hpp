// Vectors of changing size that waste little memory.
#pragma once

#include <cstddef>

namespace pf {

// Room for num items. Where std::vector would double its memory, this adds an eighth.
template <class Vector>
void reserve_tightly(Vector& vector, std::size_t num) {
  if (num > vector.capacity()) vector.reserve(vector.capacity() == 0 ? num : num + num / 8);
}

// As resize().
template <class Vector>
void resize_tightly(Vector& vector, std::size_t num) {
  reserve_tightly(vector, num);
  vector.resize(num);
}

}  // namespace pf
