#include "preprocess/build_pack.h"
