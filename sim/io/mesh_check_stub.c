#include "mesh_check.h"
status mesh_check_ply(const mesh_bytes *file, mesh_promise *promise){(void)file;(void)promise;return STATUS_OK;}
status mesh_check_obj(const mesh_bytes *file, mesh_promise *promise){(void)file;(void)promise;return STATUS_OK;}
status mesh_check_off(const mesh_bytes *file, mesh_promise *promise){(void)file;(void)promise;return STATUS_OK;}
status mesh_check_stl(const mesh_bytes *file, mesh_promise *promise){(void)file;(void)promise;return STATUS_OK;}
status mesh_check_om(const mesh_bytes *file, mesh_promise *promise){(void)file;(void)promise;return STATUS_OK;}
