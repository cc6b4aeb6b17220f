//! A labelled set of rendered people: read back by our own reader, and by COCO's own `pycocotools` (`make readers`), whose
//! evaluation finds the truth wholly similar to itself.

use crate::fixtures::skip::readers;
use orator::demo::labels::folder;
use orator::external::ffmpeg::jpeg;
use orator::formats::coco_wholebody::{CocoLabels, IMAGES};
use orator::stage::progress::Silent;
use orator::train::pose::people;
use std::process::Command;

const PYCOCOTOOLS: &str = r"
import sys
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval
coco = COCO('annotations/coco_wholebody_train.json')
person, = coco.loadCats(coco.getCatIds(catNms=['person']))
assert len(person['keypoints']) == 17 and len(person['skeleton']) == 19
people = coco.loadAnns(coco.getAnnIds(catIds=[person['id']]))
for one in people:
    sizes = [len(one[name]) for name in ('keypoints', 'foot_kpts', 'face_kpts', 'lefthand_kpts', 'righthand_kpts')]
    assert sizes == [51, 18, 204, 63, 63], sizes
    assert one['num_keypoints'] == sum(v > 0 for v in one['keypoints'][2::3])
    assert not one['foot_valid'] and not one['face_valid']
    for side in ('lefthand', 'righthand'):
        assert one[side + '_valid'] == any(one[side + '_kpts']) == any(one[side + '_box'])
found = [dict(image_id=one['image_id'], category_id=1, keypoints=one['keypoints'], score=1.0)
         for one in people if one['num_keypoints']]
result = COCOeval(coco, coco.loadRes(found), 'keypoints')
result.evaluate(); result.accumulate(); result.summarize()
print('SIMILARITY', len(coco.getImgIds()), len(people), result.stats[0])
";

#[test]
fn pycocotools_reads_a_drawn_set_and_finds_it_like_itself() {
    let dir = tempfile::tempdir().unwrap();
    let drawn = folder::draw(dir.path(), 3, 5, &Silent).unwrap();
    assert_eq!(drawn.images, [3, 0]);
    let labels = CocoLabels::read(dir.path(), "train").unwrap();
    assert_eq!((labels.images.len(), labels.annotations.len()), (3, drawn.people));
    assert!(CocoLabels::read(dir.path(), "val").unwrap().images.is_empty());
    for image in &labels.images {
        let file = dir.path().join(IMAGES).join(&image.file_name);
        let picture = jpeg::decode(&std::fs::read(file).unwrap()).unwrap();
        assert_eq!((picture.width, picture.height), (image.width, image.height));
    }
    let people = people::read(dir.path(), "train").unwrap();
    assert_eq!(people.len(), 3, "one in a picture has points");
    for person in &people {
        let [x, y, width, height] = person.bbox;
        assert!(person.area > 0.2 * width * height && person.area <= width * height, "{person:?}");
        let nose = person.points[0];
        assert!(nose[0] > x && nose[0] < x + width && nose[1] > y && nose[1] < y + height && nose[2] > 0.0);
    }
    let Some(packages) = readers("pycocotools") else { return };
    let mut python = Command::new("python3");
    python.args(["-c", PYCOCOTOOLS]).current_dir(dir.path());
    let output = python.env("PYTHONPATH", &packages).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains(&format!("SIMILARITY 3 {} 1.0", drawn.people)), "{said}");
}
