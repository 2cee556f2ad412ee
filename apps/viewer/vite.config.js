import { defineConfig } from 'vite';

export default defineConfig({
  base: '/',
  build: { outDir: 'dist', assetsInlineLimit: 0, modulePreload: { polyfill: false }, chunkSizeWarningLimit: 1000 },
  // `npm run dev` beside `btms serve`
  server: { proxy: { '/v1': process.env.BTMS_URL ?? 'http://127.0.0.1:8080' } },
});
