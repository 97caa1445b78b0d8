// Programs that are checked for leaks only: what the display's libraries leave behind is told from what the viewer
// does.
#ifdef __SANITIZE_ADDRESS__

/// Drivers stay in memory: the checker cannot name what an unloaded library has left behind.
extern "C" int dlclose(void* library);
extern "C" int dlclose(void*)
{
    return 0;
}

#endif
