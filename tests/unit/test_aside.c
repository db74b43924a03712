// Files written aside: whole or not there, and what was there before stays until the new one is whole.
#include "messages.h"

#include <setjmp.h>
#include <stdarg.h>
#include <cmocka.h>
#include <dirent.h>
#include <stdlib.h>
#include <unistd.h>

static char folder[] = "/tmp/ropsim_aside_XXXXXX";
static char path[64];

static void expect_content(const char *wanted)
{
    char text[64] = "";
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    assert_non_null(fgets(text, sizeof text, file));
    fclose(file);
    assert_string_equal(text, wanted);
}

static int count_files(void)
{
    int count = 0;
    DIR *open_folder = opendir(folder);
    assert_non_null(open_folder);
    for (const struct dirent *entry; (entry = readdir(open_folder));)
        count += entry->d_name[0] != '.';
    closedir(open_folder);
    return count;
}

static void write_text(const char *text, aside **aside)
{
    FILE *file = NULL;
    assert_int_equal(aside_open(path, NULL, aside, &file), STATUS_OK);
    assert_true(fputs(text, file) >= 0);
}

static void finished_files_replace_discarded_ones_do_not(void **state)
{
    (void)state;
    aside *aside = NULL;
    write_text("first", &aside);
    assert_int_equal(access(path, F_OK), -1);
    assert_int_equal(aside_finish(aside), STATUS_OK);
    expect_content("first");
    write_text("second", &aside);
    expect_content("first");
    aside_discard(aside);
    expect_content("first");
    assert_int_equal(count_files(), 1);
    write_text("third", &aside);
    assert_int_equal(aside_finish(aside), STATUS_OK);
    expect_content("third");
    assert_int_equal(count_files(), 1);
    aside_discard(NULL);
}

static void failures_are_said_and_leave_nothing(void **state)
{
    (void)state;
    messages messages;
    aside *aside = NULL;
    FILE *file = NULL;
    messages_start(&messages);
    assert_int_equal(aside_open("/nowhere/file", &messages.report, &aside, &file), STATUS_IO);
    assert_null(aside);
    assert_null(file);
    assert_non_null(strstr(messages.text, "/nowhere/file: cannot be written"));
    // A folder of that name cannot be replaced by a file.
    assert_int_equal(aside_open(folder, &messages.report, &aside, &file), STATUS_OK);
    assert_int_equal(aside_finish(aside), STATUS_IO);
    assert_int_equal(messages.count, 2);
}

static void shipped_files_are_found(void **state)
{
    (void)state;
    char found[4096], names[2][NAME_SIZE];
    assert_int_equal(data_path("machines", "g80.yaml", found, sizeof found), STATUS_OK);
    assert_int_equal(access(found, R_OK), 0);
    assert_int_equal(data_path("machines", "none.yaml", found, sizeof found), STATUS_IO);
    assert_int_equal(data_path("machines", "g80.yaml", found, 4), STATUS_IO);
    assert_int_equal(data_names("machines", ".yaml", names, 2), 2);
    assert_int_equal(data_names("no_such_folder", ".yaml", names, 2), 0);
}

int main(void)
{
    if (!mkdtemp(folder))
        return 1;
    snprintf(path, sizeof path, "%s/result", folder);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(finished_files_replace_discarded_ones_do_not),
        cmocka_unit_test(failures_are_said_and_leave_nothing),
        cmocka_unit_test(shipped_files_are_found),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    unlink(path);
    return failed + (rmdir(folder) != 0);
}
