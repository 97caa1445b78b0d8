// What is drawn around the picture.
#pragma once

namespace trimray {

struct ViewerPanels {
    bool menu = true, status = true, tree = false, look = false, costs = false, times = false, measure = false;
    bool handles = true;                    // of planes that cut, in the picture
    bool cheat_sheet = false, open = false; // over it, for a while
    bool wants_search = false;              // the tree's field for it is to take the keys
};

} // namespace trimray
