#include "apps/study/vision/chain_rows.h"

namespace clothfit {

const std::vector<VisionRow>& chain_rows() {
  static const std::vector<VisionRow> rows = {
      {kChainOfTags, "a fit to tags from stills, from H.264, and from H.264 with gaps"},
      {kChainOfDots, "a diagnosis of dots before two cameras"},
      {kChainOfCloth, "the surface of a real cloth that is followed by its print"},
  };
  return rows;
}

}  // namespace clothfit
