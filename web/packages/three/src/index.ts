export { HtvmMesh, pictured, PictureMap, srgbVertexColours } from './htvm_mesh.js';
export type { MeshFrame } from './htvm_mesh.js';
